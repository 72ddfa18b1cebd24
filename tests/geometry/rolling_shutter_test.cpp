// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/rolling_shutter.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <span>
#include <vector>

#include "mono3d/geometry/pose.h"

namespace mono3d {
namespace {

constexpr double kReadout_s = 0.03;

CameraModel RollingSensor(bool reads_columns = false) {
  CameraModel camera{.width = 640, .height = 480, .fx = 500, .fy = 510, .cx = 310, .cy = 245};
  camera.shutter = {kReadout_s, reads_columns};
  return camera;
}

CameraModel WithoutShutter(CameraModel camera) {
  camera.shutter = {};
  camera.distortion = {};
  return camera;
}

const CameraVelocity kFlight{{0.3, -0.6, 0.2}, {1, 0.5, -0.8}};
const Eigen::Vector3d kPoint(1.5, 1, 6);

// A motion that is a polynomial of the second degree is found again, whichever poses tell it.
TEST(VelocityThrough, FindsTheMotionThatThePosesHave) {
  CameraVelocity truth = kFlight;
  truth.angular_rad_per_s2 = {2, -1, 3};
  truth.linear_su_per_s2 = {-4, 2, 1};
  std::vector<LaterPose> around;
  for (const double time_s : {0.03, 0.07, -0.03, -0.05}) {
    around.push_back({truth.T_later_now(time_s), time_s});
  }
  for (std::size_t num = 2; num <= around.size(); ++num) {
    const auto found = VelocityThrough(std::span(around).first(num), 0.03);
    ASSERT_TRUE(found.has_value());
    EXPECT_LT((found->angular_rad_per_s - truth.angular_rad_per_s).norm(), 1e-9);
    EXPECT_LT((found->linear_su_per_s - truth.linear_su_per_s).norm(), 1e-9);
    EXPECT_LT((found->angular_rad_per_s2 - truth.angular_rad_per_s2).norm(), 1e-6);
    EXPECT_LT((found->linear_su_per_s2 - truth.linear_su_per_s2).norm(), 1e-6);
  }
  // One pose tells the mean velocity on the way to it.
  const auto mean = VelocityThrough(std::span(around).first(1), 0.03);
  ASSERT_TRUE(mean.has_value());
  EXPECT_LT(
      (mean->linear_su_per_s - VelocityOf(around[0].T_later_now, 0.03).linear_su_per_s).norm(),
      1e-9);
  around[1] = around[0];
  EXPECT_FALSE(VelocityThrough(around, 0.03).has_value());
  EXPECT_FALSE(VelocityThrough({}, 0.03).has_value());
}

// By the series of small angles, where it ends, and by sine and cosine.
TEST(CameraVelocity, MovesAPointAsItMovesTheAxes) {
  CameraVelocity velocity = kFlight;
  velocity.angular_rad_per_s2 = {2, -1, 3};
  velocity.linear_su_per_s2 = {-4, 2, 1};
  for (const double time_s : {0., 1e-9, 0.015, -0.2, 0.25, 0.3, -2.}) {
    const Eigen::Vector3d expected = velocity.T_later_now(time_s) * kPoint;
    EXPECT_LT((velocity.PointLater(time_s, kPoint) - expected).norm(), 1e-9) << time_s;
  }
}

TEST(ShutterMotion, OfAGlobalShutterMovesNothing) {
  CameraModel sensor = RollingSensor();
  sensor.shutter.readout_s = 0;
  const ShutterMotion motion(sensor, kFlight);
  EXPECT_TRUE(motion.IsStill());
  EXPECT_EQ(motion.Project(sensor, kPoint), sensor.Project(kPoint));
  EXPECT_EQ(motion.AtMiddleLine(sensor, {3, 4}, kPoint), Eigen::Vector2d(3, 4));
  EXPECT_TRUE(ShutterMotion(RollingSensor(), {}).IsStill());
  EXPECT_TRUE(ShutterMotion().IsStill());
}

TEST(ShutterMotion, ReadsTheFirstLineHalfTheReadoutBeforeTheMiddleOne) {
  const CameraModel sensor = RollingSensor();
  const ShutterMotion motion(sensor, kFlight);
  EXPECT_NEAR(motion.Time_s(sensor.Unproject({20, 0})), -kReadout_s / 2, 1e-12);
  EXPECT_NEAR(motion.Time_s(sensor.Unproject({20, 479})), kReadout_s / 2, 1e-12);
  const CameraModel turned = RollingSensor(true);
  const ShutterMotion sideways(turned, kFlight);
  EXPECT_NEAR(sideways.Time_s(turned.Unproject({0, 400})), -kReadout_s / 2, 1e-12);
  EXPECT_NEAR(sideways.Time_s(turned.Unproject({639, 20})), kReadout_s / 2, 1e-12);
}

// The line of a lens with distortion is straight before that is taken out, not after.
TEST(ShutterMotion, TakesTheLineOfTheLens) {
  CameraModel sensor = RollingSensor();
  sensor.distortion = {-0.2, 0.05, 1e-3, -1e-3, 0};
  const ShutterMotion motion(sensor, kFlight);
  const Eigen::Vector3d corner = WithoutShutter(sensor).Unproject({600, 460});
  const double time_s = motion.Time_s(corner);
  EXPECT_LT(time_s, 0.97 * ShutterMotion(RollingSensor(), kFlight).Time_s(corner));
}

// The point where it is shown and the time of that line agree with each other.
TEST(ShutterMotion, ShowsAPointOnTheLineThatIsReadThen) {
  for (const bool reads_columns : {false, true}) {
    const CameraModel sensor = RollingSensor(reads_columns);
    const ShutterMotion motion(sensor, kFlight);
    const CameraModel camera = WithoutShutter(sensor);
    const Eigen::Vector2d pixel = motion.Project(camera, kPoint);
    EXPECT_GT((pixel - camera.Project(kPoint)).norm(), 0.5);
    const double time_s = motion.Time_s(camera.Unproject(pixel));
    const Eigen::Vector3d moved =
        RotationExp(time_s * kFlight.angular_rad_per_s) * kPoint + time_s * kFlight.linear_su_per_s;
    EXPECT_LT((camera.Project(moved) - pixel).norm(), 1e-3);
    EXPECT_LT((motion.AtLineOf(camera.Unproject(pixel), kPoint) - moved).norm(), 1e-12);
  }
}

TEST(ShutterMotion, TakesAPixelBackToTheMiddleLine) {
  const CameraModel sensor = RollingSensor();
  const ShutterMotion motion(sensor, kFlight);
  const CameraModel camera = WithoutShutter(sensor);
  const Eigen::Vector2d pixel = motion.Project(camera, kPoint);
  EXPECT_LT((motion.AtMiddleLine(camera, pixel, kPoint) - camera.Project(kPoint)).norm(), 1e-3);
  // What the measurement is off by is kept.
  const Eigen::Vector2d noise(0.4, -0.3);
  const Eigen::Vector2d noisy = motion.AtMiddleLine(camera, pixel + noise, kPoint);
  EXPECT_LT((noisy - camera.Project(kPoint) - noise).norm(), 0.02);
}

TEST(ShutterMotion, OfAReversedReadoutIsTheOtherWay) {
  CameraModel sensor = RollingSensor();
  const CameraModel camera = WithoutShutter(sensor);
  const Eigen::Vector2d middle = camera.Project(kPoint);
  const Eigen::Vector2d down = ShutterMotion(sensor, kFlight).Project(camera, kPoint) - middle;
  sensor.shutter.readout_s *= -1;
  const Eigen::Vector2d up = ShutterMotion(sensor, kFlight).Project(camera, kPoint) - middle;
  EXPECT_LT((down + up).norm(), 0.1 * down.norm());
}

TEST(ShutterMotion, FollowsTheScaleOfItsWorld) {
  ShutterMotion motion(RollingSensor(), kFlight);
  const CameraModel camera = WithoutShutter(RollingSensor());
  const Eigen::Vector2d before = motion.Project(camera, kPoint);
  motion.Rescale(3);
  EXPECT_LT((motion.Project(camera, 3 * kPoint) - before).norm(), 1e-9);
}

}  // namespace
}  // namespace mono3d
