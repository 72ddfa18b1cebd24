// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "mono3d/image/keyframe_constraint.h"
#include "tracking/map/map.h"
#include "tracking/optimisation/keyframe_graph.h"
#include "tracking/optimisation/pose_constraint.h"
#include "tracking/optimisation/pose_graph.h"

namespace mono3d::tracking {

// One sigma by which a keyframe may be off from its neighbours, in rad.
double EdgeSigma(const CameraModel& camera);

// A constraint between two keyframes that were not culled, in the world's unit of now.
struct PresentConstraint {
  KeyframeId keyframe = 0;
  KeyframeId anchor = 0;
  Pose T_cam_anchor;
  double scale = 1;
  Matrix7d information = Matrix7d::Zero();
};

// A culled keyframe is replaced by the one that it is fixed to.
PresentConstraint AtPresent(const Map& map, const MapConstraint& constraint);

// The squared error of a constraint in the map as it is: chi2 of seven dimensions.
double Contradiction(const Map& map, const PresentConstraint& constraint);

// Adds the constraint as a new one; false where the map does not have both keyframes.
bool AddConstraint(Map& map, const KeyframeConstraint& constraint);

// As an edge of a pose graph.
ConstraintEdge EdgeOf(const PresentConstraint& constraint, const KeyframeGraph& graph);

// Those that have been decided on, for a pose graph and for a bundle adjustment with the views
// `view_of` each keyframe.
GraphConstraints ConstraintsOf(const Map& map, const KeyframeGraph& graph);
std::vector<PoseConstraint> ConstraintsOf(const Map& map,
                                          const std::vector<std::optional<std::size_t>>& view_of);

}  // namespace mono3d::tracking
