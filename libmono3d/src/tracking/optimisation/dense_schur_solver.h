// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "tracking/optimisation/bundle_adjustment_problem.h"

namespace mono3d::tracking {

// One stage of a bundle adjustment with few free views: Levenberg-Marquardt on the views alone,
// the points eliminated (Schur complement, dense; Triggs et al. 2000, section 6). Leaves out the
// observations marked, which must include all behind their camera. At most `num_steps` steps,
// fewer when one lowers the cost by less than the share `options.min_gain` or a stop is asked for;
// the other options are not its own. Some ten times less work than a
// general solver.
void MinimiseDensely(BundleAdjustmentProblem& problem, const std::vector<char>& left_out,
                     bool robust, int num_steps, const BundleAdjustmentOptions& options);

}  // namespace mono3d::tracking
