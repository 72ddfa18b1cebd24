// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reference/depth/pyramid_reference.h"

#include <algorithm>
#include <array>
#include <cstdint>

namespace mono3d::reference {
namespace {

int ClampedPixel(const cv::Mat& grey, int x, int y) {
  return grey.at<std::uint8_t>(std::clamp(y, 0, grey.rows - 1), std::clamp(x, 0, grey.cols - 1));
}

}  // namespace

cv::Mat Halve(const cv::Mat& grey) {
  constexpr std::array<int, 4> kWeights = {1, 3, 3, 1};
  cv::Mat half((grey.rows + 1) / 2, (grey.cols + 1) / 2, CV_8UC1);
  for (int y = 0; y < half.rows; ++y) {
    for (int x = 0; x < half.cols; ++x) {
      int sum = 32;
      for (int j = 0; j < 4; ++j) {
        for (int i = 0; i < 4; ++i) {
          sum += kWeights[std::size_t(i)] * kWeights[std::size_t(j)] *
                 ClampedPixel(grey, 2 * x - 1 + i, 2 * y - 1 + j);
        }
      }
      half.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(sum / 64);
    }
  }
  return half;
}

}  // namespace mono3d::reference
