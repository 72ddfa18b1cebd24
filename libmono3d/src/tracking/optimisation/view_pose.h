// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "tracking/map/map.h"

namespace mono3d::tracking {

struct PoseResult {
  int num_inliers = 0;
  double reprojection_px = 0;
  double noise_scale = 1;  // as in PoseEstimate
};

// Optimises the view's pose over its points; points that turn out to be outliers are taken from it.
// With a rolling shutter the velocity as well, about its prior.
PoseResult RefinePose(const Map& map, View& view);

}  // namespace mono3d::tracking
