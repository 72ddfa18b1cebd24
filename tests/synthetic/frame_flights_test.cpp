// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/frame_flights.h"

#include <gtest/gtest.h>

#include <numbers>

#include "mono3d/core/error.h"

namespace mono3d::synthetic {
namespace {

constexpr double kFrameFlightRounding = 1e-9;  // of double-precision geometry at some 100 m

TEST(OrbitFlight, KeepsItsStepAndDistance) {
  OrbitOptions options;
  options.num_frames = 10;
  options.unsteadiness.position_m = 0;
  options.unsteadiness.rotation_deg = 0;
  const std::vector<Pose> flight = OrbitFlight(options);
  ASSERT_EQ(flight.size(), 10U);
  for (std::size_t i = 1; i < flight.size(); ++i) {
    const Pose T_before_now = flight[i - 1].Inverse() * flight[i];
    EXPECT_NEAR(T_before_now.RotationAngle() * 180 / std::numbers::pi, options.step_deg, 1e-6);
    EXPECT_NEAR(flight[i].translation().head<2>().norm(), options.radius_m, kFrameFlightRounding);
    EXPECT_GT(flight[i].translation().z(), 0);
  }
}

TEST(LateralFlight, MovesToTheRightOfItsView) {
  LateralOptions options;
  options.num_frames = 5;
  options.heading_deg = 30;
  options.unsteadiness.position_m = 0;
  options.unsteadiness.rotation_deg = 0;
  const std::vector<Pose> flight = LateralFlight(options);
  const Pose T_first_last = flight.front().Inverse() * flight.back();
  EXPECT_NEAR((T_first_last.translation() - Eigen::Vector3d(4, 0, 0)).norm(), 0,
              kFrameFlightRounding);
  EXPECT_NEAR(T_first_last.RotationAngle(), 0, 1e-6);
}

TEST(FrameUnsteadiness, FollowsItsSeed) {
  OrbitOptions options;
  options.num_frames = 3;
  const std::vector<Pose> a = OrbitFlight(options);
  const std::vector<Pose> b = OrbitFlight(options);
  options.unsteadiness.seed = 2;
  const std::vector<Pose> c = OrbitFlight(options);
  EXPECT_EQ(a[2].translation(), b[2].translation());
  EXPECT_NE(a[2].translation(), c[2].translation());
}

TEST(FrameFlights, RefuseBadOptions) {
  OrbitOptions orbit;
  orbit.num_frames = 0;
  EXPECT_THROW(OrbitFlight(orbit), UsageError);
  LateralOptions lateral;
  lateral.pitch_deg = 90;
  EXPECT_THROW(LateralFlight(lateral), UsageError);
}

}  // namespace
}  // namespace mono3d::synthetic
