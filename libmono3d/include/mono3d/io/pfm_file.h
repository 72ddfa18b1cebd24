// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>

#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

// Portable float map: CV_32FC1 or CV_32FC3, channels in the order of the file. Top row first in
// memory, bottom row first in the file. Reads both byte orders and scales by nothing.
// Throws Error on another form.
cv::Mat ReadPfm(const std::filesystem::path& path);

// Little endian. Throws Error on another type or an empty image.
void WritePfm(const std::filesystem::path& path, const cv::Mat& image);

}  // namespace mono3d
