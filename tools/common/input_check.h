// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <string>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/io/frame_source.h"

namespace mono3d::tools {

// Before any work: are there images to take, three at least, and are they not all the same one?
// Throws Error with what to do otherwise. `camera`: of the images, as they are stored.
void RequireImagesOfPlaces(const std::string& input, const CameraModel& camera,
                           const FrameSourceOptions& source);

// Throws UsageError where the output folder is the one in which the images of the input lie.
void RequireOtherFolder(const std::string& input, const std::filesystem::path& output);

}  // namespace mono3d::tools
