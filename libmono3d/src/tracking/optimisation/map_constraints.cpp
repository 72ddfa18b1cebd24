// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/optimisation/map_constraints.h"

#include <cmath>
#include <cstdint>

namespace mono3d::tracking {
namespace {

// One sigma by which a keyframe is off from its neighbours, as motion in the image. It rests on
// fifty points at least (kMinSharedOfEdge) of a pixel of noise each, hence a seventh of a pixel;
// but turning and moving sideways look nearly alike, which makes some three times as much of it.
constexpr double kEdgeSigma_px = 0.5;

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

}  // namespace

double EdgeSigma(const CameraModel& camera) { return kEdgeSigma_px / camera.fx; }

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

ConstraintEdge EdgeOf(const PresentConstraint& constraint, const KeyframeGraph& graph) {
  return {*graph.node_of[constraint.anchor], *graph.node_of[constraint.keyframe],
          constraint.T_cam_anchor,           constraint.scale,
          RootOf(constraint.information),    false};
}

GraphConstraints ConstraintsOf(const Map& map, const KeyframeGraph& graph) {
  GraphConstraints constraints;
  constraints.edge_sigma = EdgeSigma(map.camera());
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
