// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>
#include <string_view>

namespace mono3d {

// Do these bytes begin as an OpenEXR file does?
bool IsExr(std::string_view bytes);

// The channel of an OpenEXR image that holds depth (see ReadDepthImage), over the display window,
// CV_32FC1, values as they are; 0 where the file has no data. Throws Error.
cv::Mat ReadExrDepth(const std::filesystem::path& path);

// The channels R, G and B of an OpenEXR image, CV_32FC3 in this order. Throws Error.
cv::Mat ReadExrColours(const std::filesystem::path& path);

// The bytes of an OpenEXR file with `image`, CV_32FC1 (channel Z) or CV_32FC3 (R, G, B), compressed
// without loss; `is_half`: in 16 bits a value.
std::string ExrBytes(const cv::Mat& image, bool is_half);

}  // namespace mono3d
