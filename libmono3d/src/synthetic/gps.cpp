// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/gps.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "mono3d/core/error.h"
#include "synthetic/noise.h"
#include "synthetic/numbers.h"

namespace mono3d::synthetic {
namespace {

using Eigen::Vector3d;

// WGS 84 (NIMA TR8350.2): semi-major axis and flattening.
constexpr double kSemiMajor_m = 6378137.0;
constexpr double kFlattening = 1 / 298.257223563;
constexpr double kEccentricity2 = kFlattening * (2 - kFlattening);

double Degrees(double radians) { return radians * 180 / std::numbers::pi; }

Vector3d ToEarthCentred(const Geodetic& place) {
  const double latitude = Radians(place.latitude_deg);
  const double longitude = Radians(place.longitude_deg);
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
  return {Degrees(latitude), Degrees(std::atan2(p.y(), p.x())), altitude};
}

// Columns: east, north, up at the origin, in earth-centred axes.
Eigen::Matrix3d EnuAxes(const Geodetic& origin) {
  const double latitude = Radians(origin.latitude_deg);
  const double longitude = Radians(origin.longitude_deg);
  Eigen::Matrix3d axes;
  axes.col(0) = Vector3d(-std::sin(longitude), std::cos(longitude), 0);
  axes.col(2) = Vector3d(std::cos(latitude) * std::cos(longitude),
                         std::cos(latitude) * std::sin(longitude), std::sin(latitude));
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return axes;
}

// Standard normal numbers (Box and Muller 1958).
double Normal(RandomNumbers& random) {
  const double u = std::max(random.Uniform(0, 1), 1e-300);
  const double v = random.Uniform(0, 1);
  return std::sqrt(-2 * std::log(u)) * std::cos(2 * std::numbers::pi * v);
}

}  // namespace

void GpsOptions::Visit(OptionVisitor& visit) {
  visit("horizontal_m", horizontal_m, "standard deviation of east and north, metres");
  visit("vertical_m", vertical_m, "standard deviation of up, metres");
  visit("correlation_s", correlation_s, "time in which an error falls to 1/e; 0: white noise");
  visit("latitude_deg", latitude_deg, "of the world's origin");
  visit("longitude_deg", longitude_deg, "of the world's origin");
  visit("altitude_m", altitude_m, "of the world's origin above the ellipsoid");
}

void GpsOptions::Validate() const {
  RequireOption(std::isfinite(horizontal_m) && horizontal_m >= 0, "gps.horizontal_m", "at least 0",
                horizontal_m);
  RequireOption(std::isfinite(vertical_m) && vertical_m >= 0, "gps.vertical_m", "at least 0",
                vertical_m);
  RequireOption(std::isfinite(correlation_s) && correlation_s >= 0, "gps.correlation_s",
                "at least 0", correlation_s);
  RequireOption(std::abs(latitude_deg) <= 89, "gps.latitude_deg", "-89 to 89", latitude_deg);
  RequireOption(std::abs(longitude_deg) <= 180, "gps.longitude_deg", "-180 to 180", longitude_deg);
  RequireOption(std::isfinite(altitude_m) && std::abs(altitude_m) <= 9000, "gps.altitude_m",
                "-9000 to 9000", altitude_m);
}

std::vector<GpsFix> GpsTrack(std::span<const double> timestamps_s, std::span<const Pose> poses,
                             const GpsOptions& options, std::uint64_t seed) {
  options.Validate();
  if (timestamps_s.size() != poses.size()) {
    throw Error(ErrorParts{.what = "GPS track: one time for each pose",
                           .where = {},
                           .expected = std::to_string(poses.size()),
                           .found = std::to_string(timestamps_s.size())});
  }
  RandomNumbers random(seed);
  const Vector3d sigma_m(options.horizontal_m, options.horizontal_m, options.vertical_m);
  Vector3d error = Vector3d::Zero();  // in standard deviations
  std::vector<GpsFix> track;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    double kept = 0;
    if (i > 0 && options.correlation_s > 0) {
      kept = std::exp(-(timestamps_s[i] - timestamps_s[i - 1]) / options.correlation_s);
    }
    for (double& axis : error) axis = kept * axis + std::sqrt(1 - kept * kept) * Normal(random);
    track.push_back({timestamps_s[i], poses[i].translation() + sigma_m.cwiseProduct(error)});
  }
  return track;
}

Geodetic ToGeodetic(const Vector3d& p_enu_m, const Geodetic& origin) {
  return FromEarthCentred(ToEarthCentred(origin) + EnuAxes(origin) * p_enu_m);
}

Vector3d ToEnu(const Geodetic& place, const Geodetic& origin) {
  return EnuAxes(origin).transpose() * (ToEarthCentred(place) - ToEarthCentred(origin));
}

}  // namespace mono3d::synthetic
