// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/positions/path_fit.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "tracking/positions/drift_estimate.h"
#include "tracking/positions/position_graph.h"

namespace mono3d::tracking {
namespace {

double FarthestMove(const std::vector<Similarity>& before, const std::vector<Similarity>& after) {
  double farthest_m = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    farthest_m = std::max(farthest_m,
                          (after[i].pose().translation() - before[i].pose().translation()).norm());
  }
  return farthest_m;
}

// What the best of the positions or known points is off by.
double SmallestError(const PositionedPath& path) {
  double smallest_m = path.typical_horizontal_m;
  for (const PathPosition& position : path.positions) {
    if (!position.covariance_m2) continue;
    smallest_m = std::min(smallest_m, std::sqrt(position.covariance_m2->diagonal().minCoeff()));
  }
  return smallest_m;
}

}  // namespace

PathFit FitPath(PositionedPath& path) {
  // What a drift of a tenth of the path leaves unexplained by the first linearisation is a
  // hundredth of it, and so on.
  constexpr int kMostRounds = 4;
  constexpr double kSettled = 0.1;  // of what positions are off by
  PathFit fit;
  for (int round = 0; round < kMostRounds; ++round) {
    DriftEstimate estimate = EstimateDrift(path);
    const std::vector<Similarity> before = path.S_metric_kf;
    if (!OptimisePath(estimate.noise, estimate.is_outlier, path)) return fit;
    fit = {estimate.noise, std::move(estimate.is_outlier), true};
    if (FarthestMove(before, path.S_metric_kf) < kSettled * SmallestError(path)) break;
  }
  return fit;
}

}  // namespace mono3d::tracking
