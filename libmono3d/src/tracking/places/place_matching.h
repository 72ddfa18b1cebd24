// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "tracking/map/map.h"

namespace mono3d::tracking {

// Features that must vote for a keyframe of the index: fewer are not worth the check.
inline constexpr int kMinVotes = 15;

// Keyframes of the index that are checked, most votes first: each costs as much as tracking a
// frame.
inline constexpr std::size_t kMaxPlaceCandidates = 2;

// A keyframe shows what an old one, of the same map or of another, has seen.
struct PlaceFound {
  KeyframeId keyframe = 0;
  KeyframeId old_keyframe = 0;
  Pose T_cam_world;  // of the keyframe, by the points of the old one
  double scale = 1;  // lengths by the old points over the same lengths by the keyframe's own
  int num_inliers = 0;
  // A point of the keyframe, and of the old one, at one pixel.
  std::vector<std::pair<PointId, PointId>> same;
};

// A pose by the old points alone, matched by descriptors (PnP within RANSAC, then all around) and
// found by their patches, then one scale from the points that both sides have. Nothing unless 50
// old points hold the pose and 20 pairs of points the scale.
std::optional<PlaceFound> MatchPlace(const Map& own_map, KeyframeId keyframe, Map& old_map,
                                     KeyframeId old_keyframe, int seed);

}  // namespace mono3d::tracking
