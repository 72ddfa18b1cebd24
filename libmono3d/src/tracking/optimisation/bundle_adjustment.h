// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "tracking/optimisation/bundle_adjustment_problem.h"

namespace mono3d::tracking {

struct BundleAdjustmentReport {
  std::vector<char> is_outlier;  // of each observation: chi2 beyond 5.991 or behind the camera
  double initial_cost = 0;       // robust, over all observations
  double final_cost = 0;         // the same after the adjustment
};

// Moves free views and all points to the least robust reprojection error, first with a Huber loss,
// then without the outliers. Runs on one thread; same input, same result.
BundleAdjustmentReport SolveBundleAdjustment(BundleAdjustmentProblem& problem,
                                             const BundleAdjustmentOptions& options = {});

}  // namespace mono3d::tracking
