// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

namespace mono3d {

// Throws Error where the image cannot be written so.
std::vector<unsigned char> JpegOf(const cv::Mat& bgr, int quality);

}  // namespace mono3d
