// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/optimisation/scale_gauge.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>
#include <vector>

#include "mono3d/core/statistics.h"
#include "mono3d/image/keyframe.h"
#include "tracking/optimisation/keyframe_graph.h"

namespace mono3d::tracking {
namespace {

std::optional<std::size_t> FirstFixed(const BundleAdjustmentProblem& problem) {
  const auto fixed = std::find(problem.is_fixed.begin(), problem.is_fixed.end(), 1);
  if (fixed == problem.is_fixed.end()) return std::nullopt;
  return static_cast<std::size_t>(fixed - problem.is_fixed.begin());
}

void ScaleAbout(const Eigen::Vector3d& centre, double factor, BundleAdjustmentProblem& problem) {
  if (!std::isfinite(factor) || !(factor > 0)) return;
  for (Pose& T_cam_world : problem.T_cam_world) {
    const Eigen::Vector3d centre_cam = T_cam_world * centre;
    T_cam_world =
        Pose(T_cam_world.rotation(), factor * centre_cam - T_cam_world.rotation() * centre);
  }
  for (Eigen::Vector3d& p_world : problem.p_world) p_world = centre + factor * (p_world - centre);
}

}  // namespace

std::optional<KeyframeId> FindScaleKeyframe(const Map& map, KeyframeId first) {
  const std::vector<KeyframeId> in_order = map.InOrderOfFlight();
  const auto place_of = [&](KeyframeId id) {
    return std::find(in_order.begin(), in_order.end(), id) - in_order.begin();
  };
  const Eigen::Vector3d centre = map.keyframe(first).view.Centre();
  std::optional<KeyframeId> best;
  double best_distance = 0;
  for (const Covisible& other : map.CovisibleKeyframes(first)) {
    if (other.num_shared < kMinSharedOfEdge) continue;
    if (std::abs(place_of(other.keyframe) - place_of(first)) >
        static_cast<std::ptrdiff_t>(kMinReturnGap))
      continue;
    const double distance = (map.keyframe(other.keyframe).view.Centre() - centre).norm();
    if (distance <= best_distance) continue;
    best_distance = distance;
    best = other.keyframe;
  }
  return best;
}

PoseConstraint HoldDistance(const BundleAdjustmentProblem& problem, std::size_t view,
                            std::size_t anchor) {
  constexpr double kSigma = 1e-4;  // of the distance: firmer than whatever else is known of it
  PoseConstraint constraint;
  constraint.view = view;
  constraint.anchor = anchor;
  constraint.T_view_anchor = problem.T_cam_world[view] * problem.T_cam_world[anchor].Inverse();
  const Eigen::Vector3d& t = constraint.T_view_anchor.translation();
  constraint.root_information.setZero();
  constraint.root_information.row(0).tail<3>() = t.transpose() / (t.squaredNorm() * kSigma);
  return constraint;
}

void RestoreDistances(const std::vector<Pose>& T_cam_world_before,
                      BundleAdjustmentProblem& problem) {
  const std::optional<std::size_t> fixed = FirstFixed(problem);
  if (!fixed) return;
  const Eigen::Vector3d centre = problem.T_cam_world[*fixed].Inverse().translation();
  const auto sum_of_distances = [&](const std::vector<Pose>& poses) {
    double sum = 0;
    for (const Pose& pose : poses) sum += (pose.Inverse().translation() - centre).norm();
    return sum;
  };
  ScaleAbout(centre, sum_of_distances(T_cam_world_before) / sum_of_distances(problem.T_cam_world),
             problem);
}

void RestoreDepths(const std::vector<Eigen::Vector3d>& p_world_before,
                   BundleAdjustmentProblem& problem) {
  const std::optional<std::size_t> fixed = FirstFixed(problem);
  if (!fixed) return;
  const Pose& T_cam_world = problem.T_cam_world[*fixed];
  std::vector<float> ratios;
  for (const BundleAdjustmentObservation& observation : problem.observations) {
    if (observation.view != *fixed) continue;
    const double before = (T_cam_world * p_world_before[observation.point]).z();
    const double now = (T_cam_world * problem.p_world[observation.point]).z();
    if (before > 0 && now > 0) ratios.push_back(static_cast<float>(before / now));
  }
  if (ratios.empty()) return;
  ScaleAbout(T_cam_world.Inverse().translation(), UpperMedianOrZero(std::move(ratios)), problem);
}

}  // namespace mono3d::tracking
