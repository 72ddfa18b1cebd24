// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>

namespace mono3d::reference {

// A CV_8UC1 image halved with the kernel (1 3 3 1) / 8 each way, borders repeated.
cv::Mat Halve(const cv::Mat& grey);

}  // namespace mono3d::reference
