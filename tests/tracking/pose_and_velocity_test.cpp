// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/optimisation/pose_and_velocity.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
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

// What is minimised, written down plainly; all measurements are taken.
double CostOf(const PoseAndVelocity& at, const VelocityPrior& prior,
              const std::vector<PointMeasurement>& measurements) {
  const ShutterMotion lines(Sensor(), kTrueVelocity);
  double cost =
      ((at.velocity.angular_rad_per_s - prior.mean.angular_rad_per_s) /
       prior.angular_sigma_rad_per_s)
          .squaredNorm() +
      ((at.velocity.linear_su_per_s - prior.mean.linear_su_per_s) / prior.linear_sigma_su_per_s)
          .squaredNorm();
  for (const PointMeasurement& m : measurements) {
    const double time_s = lines.Time_s(SmallCamera().Unproject(m.pixel));
    const Eigen::Vector3d p_line =
        at.velocity.T_later_now(time_s) * (at.pose.T_cam_world * m.p_world);
    const Eigen::Vector2d error = m.pixel - SmallCamera().Project(p_line);
    // As the sum of the noise of the pixel and of the depth, along v.
    const Eigen::Vector2d v =
        NoiseOf(SmallCamera(), at.pose.T_cam_world.rotation(), p_line, m).v_px;
    const Eigen::Matrix2d covariance =
        m.sigma_px * m.sigma_px * Eigen::Matrix2d::Identity() + v * v.transpose();
    cost += error.dot(covariance.inverse() * error);
  }
  return cost;
}

PoseAndVelocity Shifted(PoseAndVelocity state, int axis, double by) {
  Eigen::Vector3d delta = Eigen::Vector3d::Zero();
  delta(axis % 3) = by;
  Pose& T = state.pose.T_cam_world;
  switch (axis / 3) {
    case 0:
      T = Pose(RotationExp(delta) * T.rotation(), T.translation());
      break;
    case 1:
      T = Pose(T.rotation(), T.translation() + delta);
      break;
    case 2:
      state.velocity.angular_rad_per_s += delta;
      break;
    default:
      state.velocity.linear_su_per_s += delta;
  }
  return state;
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

// Along each of the twelve axes the least cost is within a tenth of a standard deviation, by the
// parabola through the cost there and on both sides.
TEST(OptimisePoseAndVelocity, EndsWhereTheCostIsLeast) {
  std::mt19937 random(SeedFromTestName());
  std::vector<PointMeasurement> measurements = MeasureInMotion(0.1, random);
  for (std::size_t i = 0; i < measurements.size(); i += 3) {
    measurements[i].depth_axis = 0.02 * (measurements[i].p_world - Eigen::Vector3d(2, 1, 0));
  }
  for (PointMeasurement& m : measurements) m.sigma_px *= 3;  // so that none is an outlier
  const VelocityPrior prior = WidePrior();
  const PoseAndVelocity found =
      OptimisePoseAndVelocity(SmallCamera(), Sensor(), kPoseInMotion, prior, measurements);
  ASSERT_EQ(found.pose.num_inliers, 150);
  const double cost = CostOf(found, prior, measurements);
  for (int axis = 0; axis < 12; ++axis) {
    constexpr double kStep = 1e-4;
    const double more = CostOf(Shifted(found, axis, kStep), prior, measurements);
    const double less = CostOf(Shifted(found, axis, -kStep), prior, measurements);
    const double information = (more + less - 2 * cost) / (2 * kStep * kStep);
    ASSERT_GT(information, 0) << axis;
    const double off = (less - more) / (4 * kStep * information);
    EXPECT_LT(std::abs(off) * std::sqrt(information), 0.1) << axis;
  }
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

// Seen from above, points whose errors have a bend in common look as from a climb that no camera
// makes; a tilt explains them as well.
TEST(OptimisePoseAndVelocity, DoesNotBelieveInASpeedThatTheCameraCannotHave) {
  std::mt19937 random(SeedFromTestName());
  const CameraModel camera = SmallCamera();
  const ShutterMotion climb(Sensor(), {{0, 0, 0}, {0, 0, 36}, {0, 0, 0}, {0, 0, 0}});
  std::vector<PointMeasurement> measurements;
  for (int i = 0; i < 150; ++i) {
    const Eigen::Vector2d at(Uniform(random, 10, camera.width - 11),
                             Uniform(random, 10, camera.height - 11));
    PointMeasurement m;
    m.p_world = 10 * camera.Unproject(at);
    m.pixel = climb.Project(camera, m.p_world);
    m.sigma_px = 0.05;
    measurements.push_back(m);
  }
  VelocityPrior prior;
  prior.angular_sigma_rad_per_s = 0.01;
  prior.linear_sigma_su_per_s = 3.6;
  const PoseAndVelocity found =
      OptimisePoseAndVelocity(camera, Sensor(), Pose(), prior, measurements);
  EXPECT_LT(found.velocity.linear_su_per_s.norm(), 1e-6);
  EXPECT_GE(found.pose.num_inliers, 135);
}

// Where points tell that it has that speed after all, they are believed.
TEST(OptimisePoseAndVelocity, BelievesInASpeedWithoutWhichPointsDoNotFit) {
  std::mt19937 random(SeedFromTestName());
  VelocityPrior prior = WidePrior();
  prior.linear_sigma_su_per_s = 0.1;
  std::vector<PointMeasurement> measurements = MeasureInMotion(0.02, random);
  for (PointMeasurement& m : measurements) m.sigma_px = 0.05;
  const PoseAndVelocity found =
      OptimisePoseAndVelocity(SmallCamera(), Sensor(), kPoseInMotion, prior, measurements);
  EXPECT_GT(found.pose.num_inliers, 135);
  EXPECT_LT((found.velocity.linear_su_per_s - kTrueVelocity.linear_su_per_s).norm(), 0.5);
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
