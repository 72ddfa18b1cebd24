// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "tracking/optimisation/bundle_adjustment_problem.h"

namespace mono3d::tracking {

// The same as MinimiseDensely for many free views, whose matrix is mostly zeros:
// Levenberg-Marquardt of Ceres with the points eliminated, on one thread.
void MinimiseSparsely(BundleAdjustmentProblem& problem, const std::vector<char>& left_out,
                      bool robust, int num_steps, const BundleAdjustmentOptions& bundle_options);

}  // namespace mono3d::tracking
