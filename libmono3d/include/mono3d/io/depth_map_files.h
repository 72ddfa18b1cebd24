// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

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

// The files of a depth map: <name>.depth<ending>, .normal<ending>, .confidence<ending>.
enum class DepthFileForm {
  kNone,   // no files
  kPfm,    // .pfm: 32-bit floats
  kExr,    // .exr: the same without loss, compressed; normals and confidence in 16-bit floats
  kPng16,  // 16.png: 16 bits. depth = value / kDepthPngScale, 0 where it is larger than fits;
           // confidence = value / 65535; red, green, blue of normals = (1 + x, y, z) / 2 * 65535
};
struct DepthFileOptions {
  DepthFileForm form = DepthFileForm::kPfm;
  bool with_previews = true;  // a .png of each, to look at
  int preview_step_px = 1;    // which shows every so many pixels and rows
};

// Depth up to 32 times the unit, which is near the mean distance of what is seen, in steps of
// 0.05 % of the unit.
inline constexpr double kDepthPngScale = 2000;

// Writes the files of `map`, and .inferred.png; images that the map does not have are left out. Of
// kPng16, scale.txt in the folder, which ReadDepthImage reads, is the caller's to write.
void WriteDepthMap(const std::filesystem::path& folder, const std::string& name,
                   const DepthMap& map, const DepthFileOptions& options = {});

// ".depth.pfm", ".depth.exr", ".depth16.png": those of each form for a kind, depth, normal or
// confidence.
std::vector<std::string> DepthFileEndings(const std::string& kind);
// What WriteDepthMap wrote, by the name's ending; ReadDepthImage reads depth. Throw Error.
cv::Mat ReadConfidence(const std::filesystem::path& path);  // CV_32FC1
cv::Mat ReadNormals(const std::filesystem::path& path);     // CV_32FC3

}  // namespace mono3d
