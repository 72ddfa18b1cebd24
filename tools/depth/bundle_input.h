// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "mono3d/core/timing.h"
#include "mono3d/geometry/camera_model.h"
#include "mono3d/image/image_bundle.h"
#include "mono3d/image/keyframe_poses.h"
#include "mono3d/tracking/image_bundle_poses.h"

namespace mono3d::tools {

struct BundleInput {
  std::vector<std::string> images;  // or one folder
  std::string camera;
  std::string poses;  // TUM file, COLMAP model; empty: estimated
  std::string resize;
  ImageBundlePosesOptions estimation;
};

struct PosedBundle {
  ImageBundle bundle;
  KeyframePoses poses;      // of its images, in the world that was given or estimated
  CameraModel calibration;  // as the file has it
  std::optional<ImageBundlePoses> estimation;  // where the poses were estimated
};

// The images that were named, or those of the one folder or glob that was, with their poses: one
// line of a TUM file each, in their order; by their names from a COLMAP model (its folder, or the
// images.txt in it), which also tells the depths of its points in them; or estimated. Throws Error
// where there are none, with the reason.
PosedBundle ReadBundle(const BundleInput& input, StageTimes* times);

// For bundle.json: how the poses came about, and what they are: camera to world, as in a TUM file.
nlohmann::ordered_json PosesRecord(const BundleInput& input, const PosedBundle& posed);

// Writes estimated poses in both forms that can be given as --poses: poses.txt and sparse/.
void WriteEstimation(const std::filesystem::path& folder, const PosedBundle& posed);

}  // namespace mono3d::tools
