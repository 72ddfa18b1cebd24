// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <vector>

#include "tracking/optimisation/bundle_adjustment_problem.h"

namespace mono3d::tracking {

// Of the path of some views: the root of the sum of the squared distances from its mean.
double PathSize(const std::vector<Pose>& T_cam_world, const std::vector<std::size_t>& views);

// How well the path of some views is known against that of others: standard deviations.
struct PathSigma {
  double rotation_rad = 0;  // of the views in the middle of either, about each axis
  double log_scale = 0;     // of the ratio of the sizes of the paths
  double residual = 0;      // root of the mean square, over what is assumed of the pixels
};

// Of the views `after` against the views `before`, by what the pixels say: from the inverse of the
// whole information matrix, the points eliminated, with the standard deviations of the pixels as
// assumed, or as the residuals have them where these are larger. What is guessed of depths does not
// count. Very large or infinite where the pixels leave it open. The cost is the cube of the number
// of views.
PathSigma RelativePathSigma(const BundleAdjustmentProblem& problem,
                            const std::vector<std::size_t>& before,
                            const std::vector<std::size_t>& after);

}  // namespace mono3d::tracking
