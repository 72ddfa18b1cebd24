// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/optimisation/pose_and_velocity.h"

#include <gtest/gtest.h>

#include <random>

#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

const Pose kPoseInMotion(RotationExp({0.1, -0.2, 0.05}), Eigen::Vector3d(0.4, -0.3, 0.2));
const CameraVelocity kTrueVelocity{{0.4, -0.6, 0.3}, {1, -0.5, 0.6}, {2, 1, -1}, {0.5, 0.2, 0}};

CameraModel Sensor() {
  CameraModel sensor = SmallCamera();
  sensor.shutter.readout_s = 0.03;
  return sensor;
}

std::vector<PointMeasurement> MeasureInMotion(double noise_px, std::mt19937& random) {
  const CameraModel camera = SmallCamera();
  const ShutterMotion motion(Sensor(), kTrueVelocity);
  std::vector<PointMeasurement> measurements;
  for (int i = 0; i < 150; ++i) {
    const Eigen::Vector2d at(Uniform(random, 10, camera.width - 11),
                             Uniform(random, 10, camera.height - 11));
    const Eigen::Vector3d p_cam = Uniform(random, 5, 15) * camera.Unproject(at);
    PointMeasurement m;
    m.p_world = kPoseInMotion.Inverse() * p_cam;
    m.pixel = motion.Project(camera, p_cam) +
              Eigen::Vector2d(Normal(random, noise_px), Normal(random, noise_px));
    m.sigma_px = std::max(0.1, noise_px);
    measurements.push_back(m);
  }
  return measurements;
}

// The accelerations are told, the velocities are not.
VelocityPrior WidePrior() {
  VelocityPrior prior;
  prior.mean = kTrueVelocity;
  prior.mean.angular_rad_per_s.setZero();
  prior.mean.linear_su_per_s.setZero();
  prior.angular_sigma_rad_per_s = prior.linear_sigma_su_per_s = 10;
  return prior;
}

double RotationError(const Pose& found) {
  return (found * kPoseInMotion.Inverse()).RotationAngle();
}

TEST(OptimisePoseAndVelocity, FindsBothWithoutNoise) {
  std::mt19937 random(SeedFromTestName());
  const PoseAndVelocity found = OptimisePoseAndVelocity(SmallCamera(), Sensor(), kPoseInMotion,
                                                        WidePrior(), MeasureInMotion(0, random));
  EXPECT_LT(RotationError(found.pose.T_cam_world), 1e-5);
  EXPECT_LT((found.velocity.angular_rad_per_s - kTrueVelocity.angular_rad_per_s).norm(), 0.005);
  EXPECT_LT((found.velocity.linear_su_per_s - kTrueVelocity.linear_su_per_s).norm(), 0.05);
  EXPECT_EQ(found.velocity.angular_rad_per_s2, kTrueVelocity.angular_rad_per_s2);
  EXPECT_EQ(found.pose.num_inliers, 150);
}

TEST(OptimisePoseAndVelocity, HoldsAVelocityThatIsKnown) {
  std::mt19937 random(SeedFromTestName());
  const VelocityPrior known{kTrueVelocity, 0, 0};
  const PoseAndVelocity found = OptimisePoseAndVelocity(SmallCamera(), Sensor(), kPoseInMotion,
                                                        known, MeasureInMotion(0.2, random));
  EXPECT_LT((found.velocity.angular_rad_per_s - kTrueVelocity.angular_rad_per_s).norm(), 1e-6);
  EXPECT_LT(RotationError(found.pose.T_cam_world), 1e-3);
  EXPECT_GT(found.pose.num_inliers, 135);
}

// A pose that takes the shutter for a global one is off, and loses most of its points.
TEST(OptimisePoseAndVelocity, KeepsPointsThatAGlobalShutterLoses) {
  std::mt19937 random(SeedFromTestName());
  const std::vector<PointMeasurement> measurements = MeasureInMotion(0.1, random);
  const PoseEstimate global = OptimisePose(SmallCamera(), kPoseInMotion, measurements);
  const PoseAndVelocity rolling =
      OptimisePoseAndVelocity(SmallCamera(), Sensor(), kPoseInMotion, WidePrior(), measurements);
  EXPECT_LT(global.num_inliers, 75);
  EXPECT_GT(rolling.pose.num_inliers, 135);
}

TEST(OptimisePoseAndVelocity, LeavesOutliersOut) {
  std::mt19937 random(SeedFromTestName());
  std::vector<PointMeasurement> measurements = MeasureInMotion(0.1, random);
  for (std::size_t i = 0; i < 30; ++i) measurements[i].pixel += Eigen::Vector2d(25, -20);
  VelocityPrior prior = WidePrior();
  prior.mean = kTrueVelocity;
  const PoseAndVelocity found =
      OptimisePoseAndVelocity(SmallCamera(), Sensor(), kPoseInMotion, prior, measurements);
  for (std::size_t i = 0; i < 30; ++i) EXPECT_EQ(found.pose.is_inlier[i], 0);
  EXPECT_LT(RotationError(found.pose.T_cam_world), 1e-3);
}

}  // namespace
}  // namespace mono3d::tracking
