// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cmath>
#include <opencv2/core/mat.hpp>

namespace mono3d {

// What is positive and finite is a depth.
inline bool IsDepth(float depth) { return depth > 0 && std::isfinite(depth); }

inline bool IsTrueDepth(float depth, double max_depth) {
  return IsDepth(depth) && (max_depth <= 0 || depth <= max_depth);
}

// Throws Error unless both are CV_32FC1 of one size and not empty.
void RequireDepthPair(const cv::Mat& estimate, const cv::Mat& truth);

// Throws Error unless the image has the type (CV_32FC1, ...) and size. `what`: "the true depth".
void RequireImage(const cv::Mat& image, const char* what, int type, const cv::Size& size);

}  // namespace mono3d
