// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <vector>

#include "tracking/optimisation/bundle_adjustment_problem.h"

namespace mono3d::tracking {

// Of the path of some views: the root of the sum of the squared distances from its mean.
double PathSize(const std::vector<Pose>& T_cam_world, const std::vector<std::size_t>& views);

// The standard deviation of the logarithm of how large the path of the views `after` is against
// that of the views `before`, by what the pixels say: from the inverse of the whole information
// matrix, the points eliminated, with the standard deviations of the pixels as assumed, or as the
// residuals have them where these are larger. What is guessed of depths does not count. Very large
// or infinite where the pixels leave it open. The cost is the cube of the number of views.
double ScaleSigma(const BundleAdjustmentProblem& problem, const std::vector<std::size_t>& before,
                  const std::vector<std::size_t>& after);

}  // namespace mono3d::tracking
