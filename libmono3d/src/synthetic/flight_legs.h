// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "synthetic/flight_options.h"

namespace mono3d::synthetic {

// Where a camera with a level horizon is and looks.
struct Aim {
  Eigen::Vector3d eye = Eigen::Vector3d::Zero();
  double yaw_rad = 0;    // from the x axis towards y
  double pitch_rad = 0;  // below the horizon
};

// A part of a flight from standstill to standstill.
struct Leg {
  double duration_s = 0;
  std::function<Aim(double t_s)> aim;  // 0 to duration_s
};
using Legs = std::vector<Leg>;

// The flight in a frame of its own: it starts over the origin, along x, with the ground at height
// 0. An orbit is around the origin.
Legs LegsOf(const FlightOptions& options);

double Duration(const Legs& legs);
Aim AimAt(const Legs& legs, double t_s);

}  // namespace mono3d::synthetic
