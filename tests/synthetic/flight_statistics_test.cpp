// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/flight_statistics.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "mono3d/core/error.h"

namespace mono3d::synthetic {
namespace {

constexpr double kStatisticsRounding = 1e-9;

TEST(FlightStatistics, AreThoseOfThreeFramesWorkedOutByHand) {
  const std::array<double, 3> times_s = {0, 0.5, 0.75};
  const std::array<Pose, 3> poses = {
      Pose(RotationExp({0, 0, 0}), Eigen::Vector3d(0, 0, 30)),
      Pose(RotationExp({0, 0, 0.1}), Eigen::Vector3d(1, 0, 30)),
      Pose(RotationExp({0, 0, 0.1}), Eigen::Vector3d(1, 0, 33)),
  };
  const FlightStatistics statistics = Summarise(SampleFlight(times_s, poses, 10));
  EXPECT_NEAR(statistics.height_m.mean, 21, kStatisticsRounding);
  EXPECT_NEAR(statistics.height_m.sigma, std::sqrt(2.0), kStatisticsRounding);
  EXPECT_NEAR(statistics.height_m.max, 23, kStatisticsRounding);
  EXPECT_NEAR(statistics.angular_velocity_rad_per_s.max, 0.2, kStatisticsRounding);
  EXPECT_NEAR(statistics.angular_velocity_rad_per_s.min, 0, 1e-6);
  EXPECT_NEAR(statistics.speed_m_per_s.mean, (2 + 12) / 2.0, kStatisticsRounding);
  EXPECT_NEAR(statistics.frames_per_s.min, 2, kStatisticsRounding);
  EXPECT_NEAR(statistics.frames_per_s.max, 4, kStatisticsRounding);
}

TEST(FlightStatistics, JoinFlights) {
  FlightSamples all{{1}, {2}, {3}, {4}};
  all.Append({{3}, {4}, {5}, {6}});
  EXPECT_NEAR(Summarise(all).height_m.mean, 2, kStatisticsRounding);
  EXPECT_NEAR(Summarise(all).frames_per_s.mean, 5, kStatisticsRounding);
  EXPECT_EQ(Summarise(FlightSamples{}).height_m.mean, 0);
}

TEST(FlightStatistics, RefuseTimesThatDoNotFitThePoses) {
  const std::array<double, 2> times_s = {1, 1};
  const std::array<Pose, 2> poses;
  EXPECT_THROW(SampleFlight(times_s, poses, 0), Error);
  EXPECT_THROW(SampleFlight(std::span(times_s).first(1), poses, 0), Error);
}

TEST(FrameTimes, AreEvenWithoutSpreadAndElseHaveItsMeanAndSigma) {
  const std::vector<double> even = FrameTimes(2, {.frames_per_s = 4});
  ASSERT_EQ(even.size(), 9U);
  EXPECT_EQ(even[8], 2);
  const std::vector<double> uneven = FrameTimes(4000, {.frames_per_s = 2, .sigma_per_s = 0.3});
  const std::vector<Pose> poses(uneven.size());
  const Spread rate = Summarise(SampleFlight(uneven, poses, 0)).frames_per_s;
  // Some 8000 draws: standard errors of 0.0034 and 0.0024; the tails beyond 3.3 sigma are cut.
  EXPECT_NEAR(rate.mean, 2, 0.015);
  EXPECT_NEAR(rate.sigma, 0.3, 0.01);
  EXPECT_THROW(FrameTimes(1, {.frames_per_s = 0}), UsageError);
}

}  // namespace
}  // namespace mono3d::synthetic
