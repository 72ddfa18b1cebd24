// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>

#include "depth/sweep_geometry.h"

namespace mono3d {

// Pixels that one source alone sees, and that it would not see at all of the depths around
// (CV_8UC1, of the size of `depth`: 255). Where the true surface leaves the view of that source,
// matching finds a false one that stays in view, and no second source tells. A surface at any depth
// from the 5 to the 95 % quantile of the inverse depths within 1.5 cells of 32 px would be in its
// view at the pixels that stay. `depth` is CV_32FC1, su, 0: no estimate, at full resolution.
cv::Mat FindDoubtfulSingleViews(const SweepGeometry& geometry, const cv::Mat& depth);

}  // namespace mono3d
