// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "tracking/map/map.h"
#include "tracking/optimisation/view_pose.h"

namespace mono3d::tracking {

// With fewer matches no pose is computed: half of them may be wrong, and kMinPoseInliers must be
// left.
inline constexpr int kMinMatches = 20;

// Matches the points of the previous view near where `view.T_cam_world`, the prediction, has them.
PoseResult TrackFromPrevious(const Map& map, const View& previous, View& view);

// Matches the points of a keyframe by their descriptors alone, starting from `view.T_cam_world`.
PoseResult TrackFromKeyframe(const Map& map, KeyframeId keyframe, View& view);

// Matches the points of the keyframes around the view. Counts for each point in view whether it was
// found.
PoseResult TrackLocalMap(Map& map, View& view);

}  // namespace mono3d::tracking
