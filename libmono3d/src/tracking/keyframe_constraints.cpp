// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/keyframe_constraints.h"

#include <cmath>
#include <cstdint>
#include <string>

#include "mono3d/core/log.h"
#include "tracking/local_mapping.h"
#include "tracking/loop_closing.h"

namespace mono3d::tracking {
namespace {

// One sigma by which a keyframe is off from its neighbours, as motion in the image. It rests on
// fifty points at least (kMinSharedOfEdge) of a pixel of noise each, hence a seventh of a pixel;
// but turning and moving sideways look nearly alike, which makes some three times as much of it.
constexpr double kEdgeSigma_px = 0.5;

// Keyframes that see the same points do not know each other better by every pair of them: so many
// in a row count once, one to the next. Farther apart in flight they are a loop that was closed.
constexpr std::size_t kMinGap = 10;

// chi2 at 99.9 % for seven dimensions: what a constraint may cost the graph. A wrong one bends the
// map, one that is left out only leaves it as it was.
constexpr double kMaxCost = 24.322;

std::optional<KeyframeId> FindFinalised(const Map& map, std::int64_t id) {
  for (KeyframeId k = 0; k < map.keyframes().size(); ++k) {
    if (map.keyframe(k).is_finalised && map.keyframe(k).id == id) return k;
  }
  return std::nullopt;
}

KeyframeId Living(const Map& map, KeyframeId id) {
  while (!map.keyframe(id).alive) id = map.keyframe(id).anchor;
  return id;
}

// An error of T_moved * T is this times the error of T: T_moved Exp(e) = Exp(this * e) T_moved.
Matrix7d Adjoint(const Pose& T_moved) {
  const Eigen::Matrix3d R = T_moved.rotation().toRotationMatrix();
  Matrix7d adjoint = Matrix7d::Identity();
  adjoint.topLeftCorner<3, 3>() = R;
  adjoint.block<3, 3>(3, 3) = R;
  for (int i = 0; i < 3; ++i) {
    adjoint.block<3, 1>(3, i) = T_moved.translation().cross(R.col(i));
  }
  return adjoint;
}

ConstraintEdge EdgeOf(const PresentConstraint& constraint, const KeyframeGraph& graph) {
  return {*graph.node_of[constraint.anchor], *graph.node_of[constraint.keyframe],
          constraint.T_cam_anchor,           constraint.scale,
          RootOf(constraint.information),    false};
}

// Moves the map to where it agrees with the new constraint; false, and nothing moved, where it
// cannot.
bool MoveTo(Map& map, const PresentConstraint& constraint, double contradiction,
            MappingTurn& turn) {
  KeyframeGraph graph = BuildGraph(map, kMinGap);
  GraphConstraints constraints = ConstraintsOf(map, graph);
  constraints.edges.push_back(EdgeOf(constraint, graph));
  constraints.edges.back().is_certain = true;
  const double length = Median(map.Depths(map.keyframe(constraint.keyframe).view));
  const KeyframeId num_keyframes = map.keyframes().size();
  PoseGraphReport report;
  {
    const WithoutMap away(turn);
    report =
        OptimisePoseGraph(graph.S_cam_world, graph.edges, length > 0 ? length : 1, constraints);
  }
  const double cost_without = report.initial_cost - contradiction;
  const bool is_credible = report.final_cost - cost_without <= kMaxCost;
  Log(LogLevel::kInfo, "keyframe " + std::to_string(map.keyframe(constraint.keyframe).id) +
                           ": the model contradicts the map (chi2 " +
                           std::to_string(contradiction) + ", " +
                           std::to_string(report.final_cost - cost_without) + " in agreement), " +
                           (is_credible ? "which follows" : "which stays"));
  if (!is_credible) return false;
  AddNewer(map, num_keyframes, constraint.keyframe, graph);
  map.Correct(graph.keyframes, graph.S_cam_world);
  return true;
}

}  // namespace

PresentConstraint AtPresent(const Map& map, const MapConstraint& constraint) {
  const double own_unit = map.keyframe(constraint.keyframe).scale;
  const double unit_of_anchor = map.keyframe(constraint.anchor).scale;
  PresentConstraint present;
  present.keyframe = Living(map, constraint.keyframe);
  present.anchor = Living(map, constraint.anchor);
  const Pose T_cam_anchor(constraint.T_cam_anchor.rotation(),
                          unit_of_anchor * constraint.T_cam_anchor.translation());
  const Pose T_cam_living =
      map.T_cam_world(constraint.keyframe) * map.T_cam_world(present.keyframe).Inverse();
  const Pose T_anchor_living =
      map.T_cam_world(constraint.anchor) * map.T_cam_world(present.anchor).Inverse();
  present.T_cam_anchor = T_cam_living.Inverse() * T_cam_anchor * T_anchor_living;
  present.scale = constraint.scale * unit_of_anchor / own_unit;
  Vector7d unit = Vector7d::Ones();
  unit.segment<3>(3).setConstant(1 / unit_of_anchor);
  const Matrix7d moved = unit.asDiagonal() * Adjoint(T_cam_living);
  present.information = moved.transpose() * constraint.information * moved;
  return present;
}

double Contradiction(const Map& map, const PresentConstraint& constraint) {
  const Pose T_cam_anchor =
      map.T_cam_world(constraint.keyframe) * map.T_cam_world(constraint.anchor).Inverse();
  Vector7d error;
  error << PoseDeviation(T_cam_anchor, constraint.T_cam_anchor), -std::log(constraint.scale);
  return error.dot(constraint.information * error);
}

bool AddConstraint(Map& map, const KeyframeConstraint& constraint) {
  const std::optional<KeyframeId> keyframe = FindFinalised(map, constraint.id);
  const std::optional<KeyframeId> anchor = FindFinalised(map, constraint.anchor_id);
  if (!keyframe || !anchor) return false;
  map.constraints().push_back({*keyframe, *anchor, constraint.T_cam_anchor, constraint.scale,
                               constraint.information, true});
  return true;
}

bool FollowConstraints(Map& map, MappingTurn& turn) {
  bool has_moved = false;
  // More of them may come, at the end of the list, while the map is given up.
  for (std::size_t i = 0; i < map.constraints().size(); ++i) {
    if (!map.constraints()[i].is_new) continue;
    const PresentConstraint constraint = AtPresent(map, map.constraints()[i]);
    const double contradiction = Contradiction(map, constraint);
    const bool is_contradicted = contradiction > kChi2SevenDof;
    const bool is_kept = constraint.keyframe != constraint.anchor &&
                         (!is_contradicted || MoveTo(map, constraint, contradiction, turn));
    has_moved = has_moved || (is_kept && is_contradicted);
    if (is_kept) {
      map.constraints()[i].is_new = false;
    } else {
      map.constraints().erase(map.constraints().begin() + static_cast<std::ptrdiff_t>(i--));
    }
  }
  if (has_moved && !turn.IsShared()) AdjustMerged(map, turn);
  return has_moved;
}

GraphConstraints ConstraintsOf(const Map& map, const KeyframeGraph& graph) {
  GraphConstraints constraints;
  constraints.edge_sigma = kEdgeSigma_px / map.camera().fx;
  for (const MapConstraint& constraint : map.constraints()) {
    if (constraint.is_new) continue;
    const PresentConstraint present = AtPresent(map, constraint);
    if (present.keyframe != present.anchor) constraints.edges.push_back(EdgeOf(present, graph));
  }
  return constraints;
}

std::vector<PoseConstraint> ConstraintsOf(const Map& map,
                                          const std::vector<std::optional<std::size_t>>& view_of) {
  std::vector<PoseConstraint> constraints;
  for (const MapConstraint& constraint : map.constraints()) {
    if (constraint.is_new) continue;
    const PresentConstraint present = AtPresent(map, constraint);
    const std::optional<std::size_t> view = view_of[present.keyframe];
    const std::optional<std::size_t> anchor = view_of[present.anchor];
    if (!view || !anchor || view == anchor) continue;
    constraints.push_back(
        {*view, *anchor, present.T_cam_anchor, RootOf(PoseInformation(present.information))});
  }
  return constraints;
}

}  // namespace mono3d::tracking
