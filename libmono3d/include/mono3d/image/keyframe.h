// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/geometry/rolling_shutter.h"
#include "mono3d/image/frame.h"

namespace MONO3D_EXPORT mono3d {

// A frame that bears novel content, with what the tracker knows of the scene in view. Where it is,
// and in which map, stands in KeyframePoses, which change; this does not.
struct Keyframe {
  std::int64_t id = 0;  // over all maps of a tracker
  Frame frame;
  // z-depths of the tracker's points that this keyframe sees, in the keyframe's own unit; may be
  // empty (bare poses).
  std::vector<float> sparse_depths_su;
  // Where the image shows each of them, in px; of bare poses empty.
  std::vector<Eigen::Vector2f> sparse_pixels = {};
  // How the camera moved while the lines were read, in the keyframe's own unit; of use where
  // frame.sensor has a rolling shutter.
  CameraVelocity velocity = {};
  // Standard deviation of where the tracker finds points of the scene in this image, over what it
  // states: more than 1 in images that are compressed, dark or blurred, never less.
  double patch_noise = 1;
};

}  // namespace mono3d
