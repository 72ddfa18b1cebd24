// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

namespace mono3d::tools {

// The bytes of an image file. Both throw Error when the image cannot be encoded.
std::string EncodePng(const cv::Mat& image);
std::string EncodeJpeg(const cv::Mat& image, int quality);  // 1 to 100

// "000042"
std::string FrameName(int frame);

}  // namespace mono3d::tools
