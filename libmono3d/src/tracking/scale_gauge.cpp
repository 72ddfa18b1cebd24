// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/scale_gauge.h"

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "tracking/local_mapping.h"

namespace mono3d::tracking {

std::optional<KeyframeId> FindScaleKeyframe(const Map& map, KeyframeId first) {
  constexpr int kSoon = 10;       // keyframes: later ones may have come back on a wrong way
  constexpr int kMinShared = 50;  // points
  const std::vector<KeyframeId> in_order = InOrderOfFlight(map);
  const auto place_of = [&](KeyframeId id) {
    return std::find(in_order.begin(), in_order.end(), id) - in_order.begin();
  };
  const Eigen::Vector3d centre = map.keyframe(first).view.Centre();
  std::optional<KeyframeId> best;
  double best_distance = 0;
  for (const Covisible& other : map.CovisibleKeyframes(first)) {
    if (other.num_shared < kMinShared) continue;
    if (std::abs(place_of(other.keyframe) - place_of(first)) > kSoon) continue;
    const double distance = (map.keyframe(other.keyframe).view.Centre() - centre).norm();
    if (distance <= best_distance) continue;
    best_distance = distance;
    best = other.keyframe;
  }
  return best;
}

PoseConstraint HoldDistance(const BundleProblem& problem, std::size_t view, std::size_t anchor) {
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

}  // namespace mono3d::tracking
