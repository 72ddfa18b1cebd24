// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <optional>
#include <string>

#include "tracking/map.h"

namespace mono3d::tracking {

struct PoseResult {
  int num_inliers = 0;
  double reprojection_px = 0;
};

// The motion that lasts `factor` times as long at the same speed and rate of turn.
Pose ScaleMotion(const Pose& motion, double factor);

// Optimises the view's pose over its points; points that turn out to be outliers are taken from it.
PoseResult RefinePose(const Map& map, View& view);

// Matches the points of the previous view near where `view.T_cam_world`, the prediction, has them.
PoseResult TrackFromPrevious(const Map& map, const View& previous, View& view);

// Matches the points of a keyframe by their descriptors alone, starting from `view.T_cam_world`.
PoseResult TrackFromKeyframe(const Map& map, KeyframeId keyframe, View& view);

// Matches the points of the keyframes around the view. Counts for each point in view whether it was
// found.
PoseResult TrackLocalMap(Map& map, View& view);

// Pose from nothing but descriptors: matches with a keyframe, those unlike all others or, where
// they are too few, those near the shift that most of the image shares; PnP within RANSAC. `view`
// gets pose and points only when it works, with ten points or more: a proposal, no proof.
PoseResult Relocalise(const Map& map, KeyframeId keyframe, View& view, int seed);

}  // namespace mono3d::tracking
