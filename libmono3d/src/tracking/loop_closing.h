// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "mono3d/tracking/tracker.h"
#include "tracking/map.h"
#include "tracking/place_index.h"

namespace mono3d::tracking {

// A keyframe that has come back to where an old one, not connected to it, has been.
struct Loop {
  KeyframeId keyframe = 0;
  KeyframeId old_keyframe = 0;
  Pose T_cam_world;  // of the keyframe, by the points of the old one
  double scale = 1;  // lengths by the old points over the same lengths by the keyframe's own
  int num_inliers = 0;
  std::vector<std::pair<PointId, PointId>> same;  // a point of the keyframe, and of the old one
};

// Candidates from the index, then a pose by the old points alone, matched by descriptors (PnP
// within RANSAC) and found by their patches, then one scale from the points that both sides have.
// Nothing unless 50 old points hold the pose and 20 pairs of points the scale.
std::optional<Loop> FindLoop(Map& map, const PlaceIndex& index, KeyframeId keyframe, int seed);

// Spreads the error over all keyframes (pose graph over Sim(3)), moves the points along, makes one
// of each pair and adjusts everything.
void CloseLoop(Map& map, const Loop& loop, const LocalMappingOptions& options);

}  // namespace mono3d::tracking
