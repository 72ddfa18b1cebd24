// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/geodetic.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace mono3d {
namespace {

using Eigen::Vector3d;

// WGS 84 (NIMA TR8350.2): semi-major axis and flattening.
constexpr double kSemiMajor_m = 6378137.0;
constexpr double kFlattening = 1 / 298.257223563;
constexpr double kEccentricity2 = kFlattening * (2 - kFlattening);

double ToRadians(double degrees) { return degrees * std::numbers::pi / 180; }
double ToDegrees(double radians) { return radians * 180 / std::numbers::pi; }

Vector3d ToEarthCentred(const Geodetic& place) {
  const double latitude = ToRadians(place.latitude_deg);
  const double longitude = ToRadians(place.longitude_deg);
  const double n =
      kSemiMajor_m / std::sqrt(1 - kEccentricity2 * std::sin(latitude) * std::sin(latitude));
  return {(n + place.altitude_m) * std::cos(latitude) * std::cos(longitude),
          (n + place.altitude_m) * std::cos(latitude) * std::sin(longitude),
          (n * (1 - kEccentricity2) + place.altitude_m) * std::sin(latitude)};
}

Geodetic FromEarthCentred(const Vector3d& p) {
  const double distance_from_axis = std::hypot(p.x(), p.y());
  double latitude = std::atan2(p.z(), distance_from_axis * (1 - kEccentricity2));
  double altitude = 0;
  // Each round gains more than two digits near the ground.
  for (int round = 0; round < 8; ++round) {
    const double s = std::sin(latitude);
    const double n = kSemiMajor_m / std::sqrt(1 - kEccentricity2 * s * s);
    // Of the two usual forms of the altitude this one holds at the poles as well.
    altitude = distance_from_axis * std::cos(latitude) + p.z() * s -
               kSemiMajor_m * std::sqrt(1 - kEccentricity2 * s * s);
    latitude = std::atan2(
        p.z(), distance_from_axis * (1 - kEccentricity2 * n / (n + std::max(altitude, -0.5 * n))));
  }
  return {ToDegrees(latitude), ToDegrees(std::atan2(p.y(), p.x())), altitude};
}

// Columns: east, north, up at the origin, in earth-centred axes.
Eigen::Matrix3d EnuAxes(const Geodetic& origin) {
  const double latitude = ToRadians(origin.latitude_deg);
  const double longitude = ToRadians(origin.longitude_deg);
  Eigen::Matrix3d axes;
  axes.col(0) = Vector3d(-std::sin(longitude), std::cos(longitude), 0);
  axes.col(2) = Vector3d(std::cos(latitude) * std::cos(longitude),
                         std::cos(latitude) * std::sin(longitude), std::sin(latitude));
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return axes;
}

}  // namespace

Geodetic ToGeodetic(const Vector3d& p_enu_m, const Geodetic& origin) {
  return FromEarthCentred(ToEarthCentred(origin) + EnuAxes(origin) * p_enu_m);
}

Vector3d ToEnu(const Geodetic& place, const Geodetic& origin) {
  return EnuAxes(origin).transpose() * (ToEarthCentred(place) - ToEarthCentred(origin));
}

}  // namespace mono3d
