// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <vector>

#include "mono3d/geometry/pose.h"
#include "mono3d/image/frame.h"

namespace mono3d {

// A frame that bears novel content, with its pose and what the tracker knows of the scene in view.
struct Keyframe {
  std::int64_t id = 0;
  int map_id = 0;  // poses of different maps have nothing in common
  Frame frame;
  Pose T_world_cam;
  // z-depths, in su, of the tracker's points that this keyframe sees; may be empty (bare poses).
  std::vector<float> sparse_depths_su;
};

// Median of `values`; 0 when there are none.
float Median(std::vector<float> values);

}  // namespace mono3d
