// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/flight.h"

#include <gtest/gtest.h>

#include <numbers>

#include "mono3d/core/error.h"
#include "mono3d/geometry/camera_model.h"
#include "synthetic/frame_flights.h"

namespace mono3d::synthetic {
namespace {

constexpr double kRounding = 1e-9;  // of double-precision geometry at some 100 m

TEST(LookAt, PutsTheTargetAtThePrincipalPointAndUpAtTheTop) {
  const Eigen::Vector3d eye(40, -30, 50);
  const Eigen::Vector3d target(2, 3, 1);
  const Pose T_cam_world = LookAt(eye, target).Inverse();
  const CameraModel camera{320, 192, 288, 288, 159.5, 95.5};
  const Eigen::Vector3d target_cam = T_cam_world * target;
  EXPECT_NEAR(target_cam.z(), (target - eye).norm(), kRounding);
  EXPECT_NEAR((camera.Project(target_cam) - Eigen::Vector2d(159.5, 95.5)).norm(), 0, 1e-6);
  const Eigen::Vector3d above_cam = T_cam_world * (target + Eigen::Vector3d::UnitZ());
  EXPECT_LT(above_cam.y(), 0);
  EXPECT_NEAR(above_cam.x(), 0, kRounding);
}

TEST(LookAt, RefusesALineOfSightWithoutHorizon) {
  EXPECT_THROW(LookAt({1, 2, 50}, {1, 2, 0}), Error);
}

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
    EXPECT_NEAR(flight[i].translation().head<2>().norm(), options.radius_m, kRounding);
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
  EXPECT_NEAR((T_first_last.translation() - Eigen::Vector3d(4, 0, 0)).norm(), 0, kRounding);
  EXPECT_NEAR(T_first_last.RotationAngle(), 0, 1e-6);
}

TEST(Unsteadiness, FollowsItsSeed) {
  OrbitOptions options;
  options.num_frames = 3;
  const std::vector<Pose> a = OrbitFlight(options);
  const std::vector<Pose> b = OrbitFlight(options);
  options.unsteadiness.seed = 2;
  const std::vector<Pose> c = OrbitFlight(options);
  EXPECT_EQ(a[2].translation(), b[2].translation());
  EXPECT_NE(a[2].translation(), c[2].translation());
}

TEST(Flights, RefuseBadOptions) {
  OrbitOptions orbit;
  orbit.num_frames = 0;
  EXPECT_THROW(OrbitFlight(orbit), UsageError);
  LateralOptions lateral;
  lateral.pitch_deg = 90;
  EXPECT_THROW(LateralFlight(lateral), UsageError);
}

}  // namespace
}  // namespace mono3d::synthetic
