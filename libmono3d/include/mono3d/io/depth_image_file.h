// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <optional>

#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

// Reads a depth image of any of these forms, by its content, as CV_32FC1; 0: no depth.
// - PFM, one channel: depth as it is.
// - PNG of 16 bits and one channel: depth = value / `png_scale`; where that is not given, the
//   number in the file scale.txt in the same folder.
// - OpenEXR, float or half: depth as it is, over the display window, from the channel named Z or,
//   failing that, Y, R or V, in a layer ("View.Depth.Z") or in none, or from the only channel.
// Negative and non-finite values, and the 1e10 that renderers write for the sky, become 0.
// Throws Error on another form, a truncated file, a PNG without a scale.
cv::Mat ReadDepthImage(const std::filesystem::path& path, std::optional<double> png_scale = {});

}  // namespace mono3d
