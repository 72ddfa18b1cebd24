// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/core/export.h"
#include "mono3d/geometry/pose.h"

namespace MONO3D_EXPORT mono3d {

// Where the camera was at a time. A trajectory is a list of these.
struct StampedPose {
  double timestamp_s = 0;
  Pose T_world_cam;
};

}  // namespace mono3d
