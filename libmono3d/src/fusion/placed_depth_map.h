// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/geometry/similarity.h"
#include "mono3d/image/depth_map.h"

namespace mono3d {

// A depth map where it belongs in the model, its depths in the unit of the world.
struct PlacedDepthMap {
  DepthMap map;
  Pose T_world_cam;
};

// `map` in its own unit.
inline PlacedDepthMap Placed(const DepthMap& map, const Similarity& S_world_kf) {
  PlacedDepthMap placed{map, S_world_kf.pose()};
  if (S_world_kf.scale() == 1) return placed;
  // An image of its own: an expression assigned as it is would be written into the caller's.
  placed.map.depth = cv::Mat(map.depth * S_world_kf.scale());
  placed.map.depth_sigma_per_square_depth = map.depth_sigma_per_square_depth / S_world_kf.scale();
  return placed;
}

}  // namespace mono3d
