// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reference/depth/census_reference.h"

#include <algorithm>

namespace mono3d::reference {

namespace {

// Of the neighbours that `wanted(dx, dy)` chooses.
template <typename Wanted>
std::vector<std::uint64_t> CensusOf(const cv::Mat& grey, unsigned quarter_turns,
                                    const Wanted& wanted) {
  std::vector<std::uint64_t> census;
  for (int y = 0; y < grey.rows; ++y) {
    for (int x = 0; x < grey.cols; ++x) {
      std::uint64_t bits = 0;
      int n = 0;
      for (int dy = -3; dy <= 3; ++dy) {
        for (int dx = -4; dx <= 4; ++dx) {
          if (!wanted(dx, dy)) continue;
          cv::Point to(dx, dy);
          for (unsigned i = 0; i < quarter_turns; ++i) to = {-to.y, to.x};
          const int row = std::clamp(y + to.y, 0, grey.rows - 1);
          const int column = std::clamp(x + to.x, 0, grey.cols - 1);
          const bool darker = grey.at<std::uint8_t>(row, column) < grey.at<std::uint8_t>(y, x);
          bits |= std::uint64_t{darker} << n++;
        }
      }
      census.push_back(bits);
    }
  }
  return census;
}

}  // namespace

std::vector<std::uint64_t> Census(const cv::Mat& grey, unsigned quarter_turns) {
  return CensusOf(grey, quarter_turns, [](int dx, int dy) { return dx != 0 || dy != 0; });
}

std::vector<std::uint32_t> HalfCensus(const cv::Mat& grey, unsigned quarter_turns) {
  const auto census =
      CensusOf(grey, quarter_turns, [](int dx, int dy) { return (dx + dy) % 2 != 0; });
  std::vector<std::uint32_t> result;
  for (const std::uint64_t bits : census) result.push_back(static_cast<std::uint32_t>(bits));
  return result;
}

}  // namespace mono3d::reference
