// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>

#include "mono3d/core/export.h"
#include "mono3d/image/sparse_model.h"

namespace MONO3D_EXPORT mono3d {

// Writes cameras, images and points3D into the folder, which is created where needed, in COLMAP's
// text form (.txt) and its binary form (.bin). The camera is a PINHOLE without distortion, an
// OPENCV camera without k3, an OPENCV_FISHEYE one with a fisheye lens, and else a FULL_OPENCV one.
// Pixels and principal point move by 0.5, for COLMAP's pixel (0, 0) is a corner; ids are one more
// than ours. The errors of points are ReprojectionErrors_px. Throws Error on an invalid model.
void WriteColmapModel(const std::filesystem::path& folder, const SparseModel& model);

// Reads the text form of such a folder, also one that COLMAP wrote. Pixels are those of the camera
// in the file, with its distortion; see ReadCameraFile for the camera models. Throws Error with
// file and line.
SparseModel ReadColmapModel(const std::filesystem::path& folder);

}  // namespace mono3d
