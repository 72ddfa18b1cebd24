// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string_view>

namespace mono3d {

// Do these bytes begin as an OpenEXR file does?
bool IsExr(std::string_view bytes);

// The channel of an OpenEXR image that holds depth (see ReadDepthImage), over the display window,
// CV_32FC1, values as they are; 0 where the file has no data. Throws Error.
cv::Mat ReadExrDepth(const std::filesystem::path& path);

}  // namespace mono3d
