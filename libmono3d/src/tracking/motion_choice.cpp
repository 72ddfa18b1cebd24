// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/motion_choice.h"

#include <algorithm>
#include <cmath>

#include "tracking/bundle_adjustment.h"
#include "tracking/frame_tracking.h"
#include "tracking/pose_optimisation.h"

namespace mono3d::tracking {
namespace {

// Two thousand measurements share one error law, so that a twentieth of the mean error is far
// outside of chance; twice that leaves room for matches that are wrong under either motion.
constexpr double kClearCost = 0.9;

// Adds a view between to the problem, at the pose that suits the points best.
void AddBetween(const BetweenView& between, const TwoViewStart& start,
                const std::vector<std::optional<std::size_t>>& point_of_feature,
                BundleProblem& problem) {
  const std::size_t view = problem.T_cam_world.size();
  std::vector<PointMeasurement> measurements;
  std::vector<BundleObservation> observations;
  for (const FeatureMatch& match : between.matches) {
    const std::optional<std::size_t> point = point_of_feature[match.feature_a];
    if (!point) continue;
    const Feature& feature = between.view->features[match.feature_b];
    measurements.push_back({start.p_a[*point], feature.pixel, feature.sigma_px});
    observations.push_back({view, *point, feature.pixel, feature.sigma_px});
  }
  constexpr std::size_t kMinMeasurements = 20;
  if (measurements.size() < kMinMeasurements) return;
  const Pose guess = ScaleMotion(start.T_b_a, between.progress);
  problem.T_cam_world.push_back(OptimisePose(problem.camera, guess, measurements).T_cam_world);
  problem.is_fixed.push_back(0);
  problem.observations.insert(problem.observations.end(), observations.begin(), observations.end());
}

// Mean robust error over the measurements; infinite where the views between add nothing.
double MeanCost(const TwoViewStart& start, const View& a, const View& b,
                const std::vector<BetweenView>& between, std::size_t num_points,
                const CameraModel& camera) {
  BundleProblem problem;
  problem.camera = camera;
  problem.T_cam_world = {Pose(), start.T_b_a};
  problem.is_fixed = {1, 0};
  problem.p_world = start.p_a;
  std::vector<std::optional<std::size_t>> point_of_feature(a.features.size());
  for (std::size_t i = 0; i < start.matches.size(); ++i) {
    const Feature& in_a = a.features[start.matches[i].feature_a];
    const Feature& in_b = b.features[start.matches[i].feature_b];
    problem.observations.push_back({0, i, in_a.pixel, in_a.sigma_px});
    problem.observations.push_back({1, i, in_b.pixel, in_b.sigma_px});
    point_of_feature[start.matches[i].feature_a] = i;
  }
  for (const BetweenView& view : between) {
    AddBetween(view, start, point_of_feature, problem);
  }
  if (problem.T_cam_world.size() < 3) return HUGE_VAL;
  constexpr int kSteps = 15;
  const BundleReport report = AdjustBundle(problem, {kSteps, 0});
  // Points that fit another motion but not this one count as if just beyond the limit.
  const auto missing = static_cast<double>(num_points - start.p_a.size());
  const double per_point =
      static_cast<double>(problem.observations.size()) / static_cast<double>(start.p_a.size());
  const double cost = report.final_cost + kChi2TwoDof * missing * per_point;
  return cost / (per_point * static_cast<double>(num_points));
}

}  // namespace

std::optional<TwoViewStart> ChooseMotion(const std::vector<TwoViewStart>& candidates, const View& a,
                                         const View& b, const std::vector<BetweenView>& between,
                                         const CameraModel& camera) {
  if (candidates.empty()) return std::nullopt;
  if (candidates.size() == 1) return candidates.front();
  std::size_t best = 0;
  double best_cost = HUGE_VAL;
  double second_cost = HUGE_VAL;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const double cost = MeanCost(candidates[i], a, b, between, candidates[0].p_a.size(), camera);
    if (cost < best_cost) {
      second_cost = best_cost;
      best_cost = cost;
      best = i;
    } else {
      second_cost = std::min(second_cost, cost);
    }
  }
  if (!(best_cost < kClearCost * second_cost)) return std::nullopt;
  return candidates[best];
}

}  // namespace mono3d::tracking
