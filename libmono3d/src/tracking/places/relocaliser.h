// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "tracking/map/map.h"
#include "tracking/optimisation/view_pose.h"
#include "tracking/places/place_index.h"

namespace mono3d::tracking {

// Pose from nothing but descriptors: matches with a keyframe, those unlike all others or, where
// they are too few, those near the shift that most of the image shares; PnP within RANSAC. `view`
// gets pose and points only when it works, with ten points or more: a proposal, no proof.
PoseResult FindPoseByKeyframe(const Map& map, KeyframeId keyframe, View& view, int seed);

// The keyframes that look most like a view, most votes first.
std::vector<PlaceMatch> LikelyPlaces(const Map& map, const PlaceIndex& places, const View& view);

// Finds a view again all over a map, by its features alone.
class Relocaliser {
 public:
  // `min_inliers`: points that a tracked pose rests on; `seed`: of RANSAC.
  Relocaliser(int min_inliers, int seed) : min_inliers_(min_inliers), seed_(seed) {}

  // Looks at the places that look most like the view, then at the newest keyframes. `view` gets
  // pose and points when it works. A pose rests on 5/3 of `min_inliers` points or more, for a wrong
  // place must not pass; where there is none, fewer than `min_inliers` are reported.
  PoseResult Relocalise(Map& map, const PlaceIndex& places, View& view) const;

 private:
  int min_inliers_;
  int seed_;
};

}  // namespace mono3d::tracking
