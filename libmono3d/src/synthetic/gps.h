// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "mono3d/core/options.h"
#include "mono3d/geometry/geodetic.h"
#include "mono3d/geometry/pose.h"

namespace mono3d::synthetic {

// A receiver of which the error wanders slowly, as that of satellite navigation does: a first-order
// Gauss-Markov process on each axis.
struct GpsOptions {
  double horizontal_m = 1.0;    // standard deviation, east and north each
  double vertical_m = 2.0;      // standard deviation, up
  double correlation_s = 30;    // after this time an error has fallen to 1/e; 0: white noise
  double latitude_deg = 49.01;  // of the world's origin
  double longitude_deg = 8.41;
  double altitude_m = 115;

  Geodetic Origin() const { return {latitude_deg, longitude_deg, altitude_m}; }
  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

struct GpsFix {
  double timestamp_s = 0;
  Eigen::Vector3d p_enu_m = Eigen::Vector3d::Zero();  // east, north, up of the origin
};

// The camera centres as the receiver tells them. The world's axes are east, north and up. Equal
// lengths of both lists; the times ascend. The same seed gives the same errors.
std::vector<GpsFix> GpsTrack(std::span<const double> timestamps_s, std::span<const Pose> poses,
                             const GpsOptions& options, std::uint64_t seed);

}  // namespace mono3d::synthetic
