// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/geometry/pose.h"
#include "mono3d/image/depth_map.h"

namespace mono3d::tools {

// A depth map, and where its keyframe is. The own unit of the keyframe is that of the world.
struct PosedDepthMap {
  DepthMap map;
  Pose T_world_cam;
};

// Depth map `index` of a straight flight over waves of textured ground, 10 su above it and looking
// down by 60 degrees; each shows a share of new ground. Depths carry a quarter of a pixel of
// matching noise at a baseline of 15 % of the depth, and 5 % of the pixels, in blocks, have no
// estimate. The focal length is 0.9 times the width.
PosedDepthMap WavyGroundMap(int width_px, int height_px, int index, double new_share = 0.06);

// The map with the pose of a tracker that is wrong: by `error_px` in the image, of which half
// is a turn and half a shift, in directions that change from map to map.
PosedDepthMap Misplaced(const PosedDepthMap& posed, double error_px, int index);

}  // namespace mono3d::tools
