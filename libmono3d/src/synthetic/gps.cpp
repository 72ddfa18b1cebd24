// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/gps.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "mono3d/core/error.h"
#include "synthetic/noise.h"

namespace mono3d::synthetic {
namespace {

using Eigen::Vector3d;

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

}  // namespace mono3d::synthetic
