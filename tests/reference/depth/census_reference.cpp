// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reference/depth/census_reference.h"

#include <algorithm>

namespace mono3d::reference {

std::vector<std::uint64_t> Census(const cv::Mat& grey) {
  std::vector<std::uint64_t> census;
  for (int y = 0; y < grey.rows; ++y) {
    for (int x = 0; x < grey.cols; ++x) {
      std::uint64_t bits = 0;
      int n = 0;
      for (int dy = -3; dy <= 3; ++dy) {
        for (int dx = -4; dx <= 4; ++dx) {
          if (dx == 0 && dy == 0) continue;
          const int row = std::clamp(y + dy, 0, grey.rows - 1);
          const int column = std::clamp(x + dx, 0, grey.cols - 1);
          const bool darker = grey.at<std::uint8_t>(row, column) < grey.at<std::uint8_t>(y, x);
          bits |= std::uint64_t{darker} << n++;
        }
      }
      census.push_back(bits);
    }
  }
  return census;
}

}  // namespace mono3d::reference
