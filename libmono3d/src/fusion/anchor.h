// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "fusion/depth_scale.h"
#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/similarity.h"
#include "mono3d/image/keyframe_poses.h"

namespace mono3d {

// A depth map of the model. The surfels that it brought lie in its camera's frame, in the unit of
// its depths: they follow wherever the keyframe goes, and whatever its depths are by the poses of
// now. That unit is the keyframe's own one times `depth_scale`.
struct Anchor {
  std::int64_t keyframe_id = 0;
  std::int64_t frame_index = 0;
  double timestamp_s = 0;
  CameraModel camera;
  // By the tracker's latest poses, from the unit of its depths; see TrackedPose.
  Similarity S_tracker_kf;
  DepthScale depth_scale;
  double median_depth_su = 0;  // in the unit of its depths
  bool is_moved = false;       // the model has it elsewhere than the tracker
  // Where the tracker had it, and the oldest keyframe of the model, when the model moved it.
  Similarity S_tracker_kf_then;
  Similarity S_tracker_oldest_then;
};

// Where the tracker has an anchor now; brings its depth_scale up to date. Nothing where the
// keyframe is not known.
std::optional<Similarity> TrackedPose(const KeyframePoses& poses, int map_id, Anchor& anchor);

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
