// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <opencv2/core/mat.hpp>

namespace mono3d::reference {

// A CV_8UC1 image halved with the kernel (1 3 3 1) / 8 each way, borders repeated.
cv::Mat Halve(const cv::Mat& grey);

// The images half a pixel to the right, below, and both, borders repeated; means are rounded up.
std::array<cv::Mat, 3> HalfPixelImages(const cv::Mat& grey);

}  // namespace mono3d::reference
