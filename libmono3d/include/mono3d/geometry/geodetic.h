// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>

#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

// A place on the ellipsoid WGS 84.
struct Geodetic {
  double latitude_deg = 0;   // -90 to 90, north positive
  double longitude_deg = 0;  // -180 to 180, east positive
  double altitude_m = 0;     // above the ellipsoid
};

// Local east, north, up to the ellipsoid and back, through earth-centred coordinates; exact to
// 1e-6 m within 100 km of the origin.
Geodetic ToGeodetic(const Eigen::Vector3d& p_enu_m, const Geodetic& origin);
Eigen::Vector3d ToEnu(const Geodetic& place, const Geodetic& origin);

}  // namespace mono3d
