// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>

#include "mono3d/core/export.h"
#include "mono3d/image/depth_map.h"

namespace MONO3D_EXPORT mono3d {

// Pictures to look at, CV_8UC3 (BGR); no estimate is black.
// Inverse depth from blue (far) to red (near), between its 2 % and 98 % quantiles.
cv::Mat DepthPreview(const cv::Mat& depth);
// Right, up and towards the camera as red, green and blue.
cv::Mat NormalPreview(const cv::Mat& normal);
// Grey; 1 is white.
cv::Mat ConfidencePreview(const cv::Mat& confidence);

// Any 8-bit image. Throws Error when it cannot be written.
void WritePng(const std::filesystem::path& path, const cv::Mat& image);

// Writes <folder>/<name>.depth.pfm, .normal.pfm and .confidence.pfm, a preview .png of each, and
// .inferred.png; images that the map does not have are left out.
void WriteDepthMap(const std::filesystem::path& folder, const std::string& name,
                   const DepthMap& map);

}  // namespace mono3d
