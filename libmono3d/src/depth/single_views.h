// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>

#include "depth/sweep_geometry.h"

namespace mono3d {

// Of each pixel (CV_8UC1), whether one source alone sees its point.
enum SingleView : std::uint8_t {
  kNotSingle = 0,  // more see it, or there is no depth
  kSingle = 1,
  // That source would not see it at all of the depths around: from the 5 to the 95 % quantile of
  // the inverse depths within 1.5 cells of 32 px. Where the true surface leaves the view of that
  // source, matching finds a false one that stays in view, and no second source tells.
  kDoubtfulSingle = 255,
};

// `depth` is CV_32FC1, su, 0: no estimate, at full resolution.
cv::Mat FindSingleViews(const SweepGeometry& geometry, const cv::Mat& depth);

}  // namespace mono3d
