// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstdint>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/similarity.h"

namespace mono3d {

// A depth map of the model. The surfels that it brought lie in its camera's frame, in the own unit
// of its keyframe: they follow wherever the keyframe goes.
struct Anchor {
  std::int64_t keyframe_id = 0;
  std::int64_t frame_index = 0;
  double timestamp_s = 0;
  CameraModel camera;
  Similarity S_tracker_kf;     // S_world_kf of the tracker's latest poses
  double median_depth_su = 0;  // in the own unit
  bool is_moved = false;       // the model has it elsewhere than the tracker
  // Where the tracker had it, and the oldest keyframe of the model, when the model moved it.
  Similarity S_tracker_kf_then;
  Similarity S_tracker_oldest_then;
};

// An anchor where it is in the world.
struct PlacedAnchor {
  const Anchor& anchor;
  const Similarity& S_world_kf;

  double median_depth() const { return S_world_kf.scale() * anchor.median_depth_su; }
};

// What it looks at, in the world.
Eigen::Vector3d Centre(const PlacedAnchor& view);
// Places at which it looks, in the world: near its corners, its sides, its middle.
std::array<Eigen::Vector3d, 9> Places(const PlacedAnchor& view);
// Whether it has a point of the world in its image, whatever stands before it.
bool Sees(const PlacedAnchor& view, const Eigen::Vector3d& point_world);
// How far a motion of the world takes what it looks at, over its depth.
double MotionOverDepth(const PlacedAnchor& view, const Similarity& motion);

}  // namespace mono3d
