// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/gps.h"

#include <gtest/gtest.h>

#include <cmath>

#include "mono3d/core/error.h"

namespace mono3d::synthetic {
namespace {

struct StillFlight {
  std::vector<double> times_s;
  std::vector<Pose> poses;
};

StillFlight Still(int count, double step_s) {
  StillFlight flight;
  for (int i = 0; i < count; ++i) flight.times_s.push_back(i * step_s);
  flight.poses.assign(static_cast<std::size_t>(count),
                      Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(10, 20, 30)));
  return flight;
}

TEST(GpsTrack, HasTheStandardDeviationAndCorrelationAskedFor) {
  constexpr int kCount = 20'000;
  GpsOptions options;
  options.horizontal_m = 1.5;
  options.vertical_m = 4;
  options.correlation_s = 5;
  const StillFlight flight = Still(kCount, 1);
  const std::vector<GpsFix> track = GpsTrack(flight.times_s, flight.poses, options, 3);
  Eigen::Vector3d square = Eigen::Vector3d::Zero();
  double product = 0;
  for (std::size_t i = 0; i < track.size(); ++i) {
    const Eigen::Vector3d error = track[i].p_enu_m - Eigen::Vector3d(10, 20, 30);
    square += error.cwiseAbs2() / kCount;
    if (i > 0) product += error.x() * (track[i - 1].p_enu_m.x() - 10) / kCount;
  }
  // 20000 values that hang together over 5 have the worth of some 2000: 1.6 % of error, four times.
  constexpr double kShare = 0.065;
  EXPECT_NEAR(std::sqrt(square.x()), 1.5, 1.5 * kShare);
  EXPECT_NEAR(std::sqrt(square.y()), 1.5, 1.5 * kShare);
  EXPECT_NEAR(std::sqrt(square.z()), 4, 4 * kShare);
  EXPECT_NEAR(product / square.x(), std::exp(-0.2), 0.03);
}

TEST(GpsTrack, WithoutNoiseIsTheFlight) {
  GpsOptions options;
  options.horizontal_m = 0;
  options.vertical_m = 0;
  const StillFlight flight = Still(5, 0.5);
  for (const GpsFix& fix : GpsTrack(flight.times_s, flight.poses, options, 1)) {
    EXPECT_EQ(fix.p_enu_m, Eigen::Vector3d(10, 20, 30));
  }
}

TEST(GpsTrack, RefusesBadInput) {
  const StillFlight flight = Still(5, 0.5);
  GpsOptions options;
  EXPECT_THROW(GpsTrack(std::vector<double>{0}, flight.poses, options, 1), Error);
  options.horizontal_m = -1;
  EXPECT_THROW(GpsTrack(flight.times_s, flight.poses, options, 1), UsageError);
  options.horizontal_m = 1;
  options.latitude_deg = 90;
  EXPECT_THROW(options.Validate(), UsageError);
}

}  // namespace
}  // namespace mono3d::synthetic
