// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace mono3d::tracking {

// A grey image (CV_8UC1) and its smoothed halvings: what shows at pixel p of the image shows at
// p / 2^o of octave o.
using Octaves = std::vector<cv::Mat>;

inline constexpr int kNumOctaves = 4;  // the coarsest bridges motions of some 30 px

// Fewer than kNumOctaves where the image is too small for more.
Octaves BuildOctaves(const cv::Mat& grey);

// Brightness between the pixels, bilinear; `x` and `y` must be at least 0 and less than the last
// column and row.
inline float Interpolate(const cv::Mat& image, float x, float y) {
  const auto column = static_cast<int>(x);
  const auto row = static_cast<int>(y);
  const float u = x - static_cast<float>(column);
  const float v = y - static_cast<float>(row);
  const std::uint8_t* above = image.ptr<std::uint8_t>(row) + column;
  const std::uint8_t* below = above + image.step[0];
  return (1 - v) * ((1 - u) * static_cast<float>(above[0]) + u * static_cast<float>(above[1])) +
         v * ((1 - u) * static_cast<float>(below[0]) + u * static_cast<float>(below[1]));
}

}  // namespace mono3d::tracking
