// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/geometry/rolling_shutter.h"

namespace mono3d::tracking {

// What is known of the velocity of a frame before its image is looked at.
struct VelocityPrior {
  CameraVelocity mean = {};
  // Standard deviations of each axis; 0: the velocity is held.
  double angular_sigma_rad_per_s = 0;
  double linear_sigma_su_per_s = 0;
};

}  // namespace mono3d::tracking
