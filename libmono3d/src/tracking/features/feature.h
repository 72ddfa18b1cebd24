// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>

#include "tracking/features/descriptor.h"

namespace mono3d::tracking {

struct Feature {
  Eigen::Vector2d pixel;  // in the full image
  int level = 0;          // of the pyramid
  double angle_deg = 0;   // of the patch, 0 to 360
  double response = 0;    // FAST score
  double sigma_px = 1;    // standard deviation of `pixel` in x and in y
  Descriptor descriptor{};
};

}  // namespace mono3d::tracking
