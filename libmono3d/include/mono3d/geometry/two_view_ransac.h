// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/geometry/homography.h"

namespace MONO3D_EXPORT mono3d {

struct TwoViewRansacOptions {
  // At most; enough for 60 % of outliers: of so many sets of seven pairs one is free of them with
  // 99.9 % (0.4^7 = 0.0016). With fewer outliers fewer are drawn.
  int max_rounds = 5000;
  double sigma_px = 1;  // standard deviation of a measured point
  int seed = 1;         // same seed, same result
};

// A two-view model with what speaks for it. The score sums, over both directions of every inlier,
// 5.991 minus the squared distance over sigma^2: the same top for both models, so that scores
// compare (Mur-Artal, Montiel, Tardos 2015, eq. (2)).
struct TwoViewModel {
  Eigen::Matrix3d matrix;  // H or F
  double score = 0;
  std::vector<char> is_inlier;  // of each pair
  int num_inliers = 0;
};

// The best homography over random sets (cv::findHomography with UsacParams: Raguram et al. 2013,
// and locally optimised: Chum, Matas, Kittler 2003), refitted to its inliers. Inlier: symmetric
// transfer error below chi2(95 %, 2) = 5.991. Nothing when there are fewer than 8 pairs or no set
// determines one.
std::optional<TwoViewModel> EstimateHomography(std::span<const PointPair> pairs,
                                               const TwoViewRansacOptions& options);

// The same for a fundamental matrix; distances from the epipolar lines, chi2(95 %, 1) = 3.841.
std::optional<TwoViewModel> EstimateFundamental(std::span<const PointPair> pairs,
                                                const TwoViewRansacOptions& options);

}  // namespace mono3d
