// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>

#include "mono3d/geometry/pose.h"

namespace mono3d {

// A keyframe that is final and was moved nevertheless: by the closing of a loop, or because its
// map was joined with another one.
struct KeyframeCorrection {
  std::int64_t id = 0;  // of the keyframe
  int map_id = 0;       // from now on: where maps were joined, not the one it was handed out with
  Pose T_world_cam;     // from now on
  double scale = 1;     // lengths around it, over those at the time it was handed out
};

}  // namespace mono3d
