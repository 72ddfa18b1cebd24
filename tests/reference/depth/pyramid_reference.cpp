// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reference/depth/pyramid_reference.h"

#include <algorithm>
#include <cstdint>

namespace mono3d::reference {
namespace {

int Pixel(const cv::Mat& grey, int x, int y) {
  return grey.at<std::uint8_t>(std::clamp(y, 0, grey.rows - 1), std::clamp(x, 0, grey.cols - 1));
}

int RoundedMean(int a, int b) { return (a + b + 1) / 2; }

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
                 Pixel(grey, 2 * x - 1 + i, 2 * y - 1 + j);
        }
      }
      half.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(sum / 64);
    }
  }
  return half;
}

std::array<cv::Mat, 3> HalfPixelImages(const cv::Mat& grey) {
  std::array<cv::Mat, 3> images = {grey.clone(), grey.clone(), grey.clone()};
  for (int y = 0; y < grey.rows; ++y) {
    for (int x = 0; x < grey.cols; ++x) {
      const int right = RoundedMean(Pixel(grey, x, y), Pixel(grey, x + 1, y));
      const int below = RoundedMean(Pixel(grey, x, y), Pixel(grey, x, y + 1));
      const int below_right = RoundedMean(Pixel(grey, x, y + 1), Pixel(grey, x + 1, y + 1));
      images[0].at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(right);
      images[1].at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(below);
      images[2].at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(RoundedMean(right, below_right));
    }
  }
  return images;
}

}  // namespace mono3d::reference
