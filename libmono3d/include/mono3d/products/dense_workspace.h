// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/products/finished_run.h"

namespace MONO3D_EXPORT mono3d {

// Writes a folder as COLMAP's image_undistorter and patch_match_stereo leave it, which
// stereo_fusion and OpenMVS's InterfaceCOLMAP take: images/ free of distortion and of the depth
// maps' size, sparse/ of them, stereo/depth_maps/NAME.geometric.bin and stereo/normal_maps/ beside
// it in the unit of the model, stereo/fusion.cfg with the images that have a depth map. Estimates
// of a confidence below `min_confidence` are left out where the run wrote confidence. Returns the
// folders. Throws Error where the run has no depth maps or no images, and on a file that cannot be
// read or written.
std::vector<std::filesystem::path> WriteDenseWorkspace(const std::filesystem::path& folder,
                                                       const FinishedRun& run,
                                                       double min_confidence = 0);

// Writes the depth maps into the folder as TIFF files of 32-bit floats, in the unit of the model, 0
// where there is no estimate: NAME.tif. Returns them. Throws Error as above.
std::vector<std::filesystem::path> WriteDepthTiffs(const std::filesystem::path& folder,
                                                   const FinishedRun& run);

// A float matrix, CV_32FC1 or CV_32FC3, as COLMAP writes it: "width&height&channels&", then its
// values row by row, channel by channel.
void WriteColmapArray(const std::filesystem::path& file, const cv::Mat& matrix);

}  // namespace mono3d
