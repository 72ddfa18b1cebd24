// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/products/finished_run.h"

namespace MONO3D_EXPORT mono3d {

// Writes transforms.json into the folder, as nerfstudio and other trainers of radiance fields read
// it: cameras (OPENCV, or OPENCV_FISHEYE for fisheye lenses; the principal point counted from the
// corner of the image), poses camera to world with y up and z backwards in the camera, the world as
// the model has it (z up), images by their paths from the folder; and beside it sparse.ply, the
// points of the sparse model. Images are those of the run, or, with `is_undistorted`, written into
// images/ free of distortion, without loss. Keyframes whose image is not there are left out.
// Returns the files. Throws Error where no image is there or a file cannot be written.
std::vector<std::filesystem::path> WriteNerfstudio(const std::filesystem::path& folder,
                                                   const FinishedRun& run,
                                                   bool is_undistorted = false);

}  // namespace mono3d
