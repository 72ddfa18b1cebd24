// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <optional>

#include "io/calibration_yaml.h"
#include "mono3d/geometry/camera_model.h"

namespace mono3d {

// The camera of a file that other programs write, by its keys; nothing where it is none of these.
// - Kalibr: cam0 with camera_model, intrinsics, distortion_model, distortion_coeffs, resolution
//   (https://github.com/ethz-asl/kalibr/wiki/yaml-formats).
// - ORB-SLAM: Camera.fx or Camera1.fx and so on, with Camera.width and Camera.height.
// - nerfstudio and Instant NGP: fl_x and so on of a transforms.json, or camera_angle_x
//   (https://docs.nerf.studio/quickstart/data_conventions.html). The principal point counts from
//   the corner of the first pixel, as what COLMAP found is written there as it is.
// Distortion that is not told is none.
std::optional<CameraModel> ParseKalibr(const CalibrationYaml& yaml);
std::optional<CameraModel> ParseOrbSlam(const CalibrationYaml& yaml);
std::optional<CameraModel> ParseNerfstudio(const CalibrationYaml& yaml);

}  // namespace mono3d
