// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "tracking/map/map.h"
#include "tracking/optimisation/bundle_adjustment_problem.h"
#include "tracking/optimisation/pose_constraint.h"

// What holds the scale of a map while all of it is adjusted. The pixels leave it open, and with one
// view fixed it wanders by several percent in the steps of a loop that converges; lengths that are
// known otherwise (KeyframeConstraint) would then no longer fit.
namespace mono3d::tracking {

// The keyframe whose distance from the first one gives the map its scale: the farthest of those
// that came soon before or after it and share its points well. Nothing where there is none.
std::optional<KeyframeId> FindScaleKeyframe(const Map& map, KeyframeId first);

// Holds the distance between two views, and nothing else.
PoseConstraint HoldDistance(const BundleAdjustmentProblem& problem, std::size_t view,
                            std::size_t anchor);

// After an adjustment, scales all about the first fixed view. RestoreDistances: to where the sum of
// the distances of the others from it is what it was. RestoreDepths: to where the points that it
// sees are, in the median, as far away as they were, as a loop may have changed the distances of
// its neighbours. Nothing without a fixed view.
void RestoreDistances(const std::vector<Pose>& T_cam_world_before,
                      BundleAdjustmentProblem& problem);
void RestoreDepths(const std::vector<Eigen::Vector3d>& p_world_before,
                   BundleAdjustmentProblem& problem);

}  // namespace mono3d::tracking
