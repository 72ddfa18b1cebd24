// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/positions/image_drift.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <span>
#include <unordered_map>
#include <utility>

#include "mono3d/core/statistics.h"
#include "tracking/optimisation/path_uncertainty.h"

namespace mono3d::tracking {
namespace {

// The keyframes and the points that two or more of them see.
BundleAdjustmentProblem ProblemOf(const Map& map, std::span<const KeyframeId> keyframes) {
  BundleAdjustmentProblem problem;
  problem.camera = map.camera();
  std::vector<PointId> points;
  std::vector<std::vector<BundleAdjustmentObservation>> seen_of;  // of each point
  std::unordered_map<std::size_t, std::size_t> number_of;         // by place in the map
  for (std::size_t view = 0; view < keyframes.size(); ++view) {
    const View& seeing = map.keyframe(keyframes[view]).view;
    problem.T_cam_world.push_back(map.T_cam_world(keyframes[view]));
    problem.is_fixed.push_back(0);
    for (std::size_t i = 0; i < seeing.points.size(); ++i) {
      const std::optional<PointId>& point = seeing.points[i];
      if (!point || !map.IsAlive(*point)) continue;
      const auto [found, is_new] = number_of.try_emplace(point->index, points.size());
      if (is_new) {
        points.push_back(*point);
        seen_of.emplace_back();
      }
      const Feature& feature = seeing.features[i];
      const Eigen::Vector2d pixel =
          map.AtMiddleLine(seeing, feature.pixel, map.point(*point).p_world);
      seen_of[found->second].push_back({view, 0, pixel, feature.sigma_px});
    }
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (seen_of[i].size() < 2) continue;
    for (BundleAdjustmentObservation& seen : seen_of[i]) {
      seen.point = problem.p_world.size();
      problem.observations.push_back(seen);
    }
    problem.p_world.push_back(map.point(points[i]).p_world);
  }
  return problem;
}

// What bends a path, over what the residuals of its points show. Errors that a patch has in all its
// images do not bend it, and residuals do not show them; those that it has in neighbouring ones do,
// and are shown in part. Measured on five simulated flights of 2 km: 1 to 2.3.
constexpr double kOverResiduals = 1.8;
// Residuals smaller than this, over what is assumed of the pixels, are not taken for their errors.
constexpr double kLeastResidual = 0.1;

// By the residuals instead of what is assumed.
double ByResiduals(const PathSigma& sigma) {
  return kOverResiduals * std::max(kLeastResidual, sigma.residual) / std::max(1.0, sigma.residual);
}

}  // namespace

std::vector<BundleAdjustmentProblem> StretchesOf(const Map& map,
                                                 const std::vector<KeyframeId>& keyframes) {
  // Points are seen by some ten keyframes: many times that is long enough for the random walk to
  // be most of what either end is off by. More stretches than these tell nothing new.
  constexpr std::size_t kLongest = 96;
  constexpr std::size_t kShortest = 9;
  constexpr std::size_t kMostStretches = 5;
  std::vector<BundleAdjustmentProblem> stretches;
  if (keyframes.size() < kShortest) return stretches;
  const std::size_t length = std::min(kLongest, keyframes.size());
  const std::size_t num = std::min(kMostStretches, keyframes.size() / length);
  for (std::size_t i = 0; i < num; ++i) {
    const std::size_t first =
        num == 1 ? (keyframes.size() - length) / 2 : i * (keyframes.size() - length) / (num - 1);
    stretches.push_back(ProblemOf(map, std::span(keyframes).subspan(first, length)));
  }
  return stretches;
}

std::optional<PathDrift> ImageDrift(std::span<const BundleAdjustmentProblem> stretches) {
  // Where points leave a stretch open, it tells nothing of the others.
  constexpr double kOpen = 1;
  std::vector<double> rotations_rad;
  std::vector<double> log_scales;
  for (const BundleAdjustmentProblem& stretch : stretches) {
    const std::size_t length = stretch.T_cam_world.size();
    const std::size_t third = length / 3;
    std::vector<std::size_t> before(third);
    std::iota(before.begin(), before.end(), 0);
    std::vector<std::size_t> after(third);
    std::iota(after.begin(), after.end(), length - third);
    const auto steps = static_cast<double>(length - third);  // between the middles of both
    // The means of a random walk over two windows differ by less than its values in their middles.
    const double steps_of_means = steps - static_cast<double>(third) / 3;
    const PathSigma sigma = RelativePathSigma(stretch, before, after);
    if (!(sigma.rotation_rad < kOpen) || !(sigma.log_scale < kOpen)) continue;
    rotations_rad.push_back(ByResiduals(sigma) * sigma.rotation_rad / std::sqrt(steps));
    log_scales.push_back(ByResiduals(sigma) * sigma.log_scale / std::sqrt(steps_of_means));
  }
  if (rotations_rad.empty()) return std::nullopt;
  return PathDrift{UpperMedian(std::move(rotations_rad)), UpperMedian(std::move(log_scales))};
}

}  // namespace mono3d::tracking
