// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "mono3d/image/keyframe_constraint.h"
#include "tracking/keyframe_graph.h"
#include "tracking/map.h"
#include "tracking/map_turn.h"
#include "tracking/pose_constraint.h"
#include "tracking/pose_graph.h"

namespace mono3d::tracking {

// A constraint of the map between two living keyframes, as poses and lengths are now.
struct PresentConstraint {
  KeyframeId keyframe = 0;
  KeyframeId anchor = 0;
  Pose T_cam_anchor;
  double scale = 1;
  Matrix7d information = Matrix7d::Zero();
};

// A culled keyframe stands for the one that it is fixed to.
PresentConstraint AtPresent(const Map& map, const MapConstraint& constraint);

// How much the map contradicts a constraint: chi2 of seven dimensions.
double Contradiction(const Map& map, const PresentConstraint& constraint);

// Takes the constraint over, as a new one; false where the map does not have both keyframes.
bool AddConstraint(Map& map, const KeyframeConstraint& constraint);

// Decides on the new constraints. One that the map does not contradict is kept. For one that it
// does the pose graph is moved: where all edges can agree with it, at what a tracker may drift by
// from one keyframe to the next, the map follows and it is kept; else it is dropped, and the map is
// as it was. True when the map has moved; then everything is adjusted, unless the map is shared.
bool FollowConstraints(Map& map, MappingTurn& turn);

// Those that have been decided on, for a pose graph and for a bundle adjustment with the views
// `view_of` each keyframe.
GraphConstraints ConstraintsOf(const Map& map, const KeyframeGraph& graph);
std::vector<PoseConstraint> ConstraintsOf(const Map& map,
                                          const std::vector<std::optional<std::size_t>>& view_of);

}  // namespace mono3d::tracking
