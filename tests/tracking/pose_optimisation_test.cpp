// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/optimisation/pose_optimisation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

const Pose kTruth(RotationExp({0.1, -0.2, 0.05}), Eigen::Vector3d(0.4, -0.3, 0.2));

// Points in front of the camera, the first of them wrong by 20 px and more.
std::vector<PointMeasurement> Measure(int num_points, int num_outliers, double noise_px,
                                      double scale, std::mt19937& random) {
  const CameraModel camera = SmallCamera();
  const Pose T_world_cam = Pose(kTruth.rotation(), scale * kTruth.translation()).Inverse();
  std::vector<PointMeasurement> measurements;
  for (int i = 0; i < num_points; ++i) {
    PointMeasurement m;
    m.pixel = {Uniform(random, 0, camera.width - 1), Uniform(random, 0, camera.height - 1)};
    m.p_world = T_world_cam * (scale * Uniform(random, 5, 15) * camera.Unproject(m.pixel));
    m.pixel += Eigen::Vector2d(Normal(random, noise_px), Normal(random, noise_px));
    if (i < num_outliers) {
      m.pixel += Eigen::Vector2d(Uniform(random, 20, 60), Uniform(random, -60, 60));
    }
    measurements.push_back(m);
  }
  return measurements;
}

TEST(ProjectionJacobian, EqualsCentralDifferences) {
  std::mt19937 random(SeedFromTestName());
  const CameraModel camera = SmallCamera();
  for (int trial = 0; trial < 20; ++trial) {
    const Eigen::Vector3d p_world(Normal(random, 1), Normal(random, 1), Uniform(random, 4, 8));
    const Eigen::Vector3d rotated = kTruth.rotation() * p_world;
    const auto J = ProjectionJacobian(camera, rotated + kTruth.translation(), rotated);
    for (int k = 0; k < 6; ++k) {
      constexpr double kStep = 1e-6;
      const auto project = [&](double step) {
        Eigen::Matrix<double, 6, 1> delta = Eigen::Matrix<double, 6, 1>::Zero();
        delta[k] = step;
        const Pose moved(RotationExp(delta.head<3>()) * kTruth.rotation(),
                         kTruth.translation() + delta.tail<3>());
        return camera.Project(moved * p_world);
      };
      const Eigen::Vector2d numeric = (project(kStep) - project(-kStep)) / (2 * kStep);
      EXPECT_LT((J.col(k) - numeric).norm(), 1e-5 * (1 + numeric.norm()));
    }
  }
}

// Points whose depths are guessed, all 40 % too far, seen before from `centre`.
std::vector<PointMeasurement> MeasureDirections(int num_points, const Eigen::Vector3d& centre,
                                                std::mt19937& random) {
  std::vector<PointMeasurement> measurements = Measure(num_points, 0, 0.1, 1, random);
  for (PointMeasurement& m : measurements) {
    m.sigma_px = 0.1;
    m.p_world = centre + 1.4 * (m.p_world - centre);
    m.depth_axis = 0.5 * (m.p_world - centre);
  }
  return measurements;
}

TEST(OptimisePose, DirectionsHoldTheRotationWhereTheCameraTurnsOnTheSpot) {
  std::mt19937 random(SeedFromTestName());
  const Eigen::Vector3d centre = kTruth.Inverse().translation();
  const auto measurements = MeasureDirections(100, centre, random);
  const Pose start(RotationExp({0, 0.02, 0}) * kTruth.rotation(), kTruth.translation());
  const PoseEstimate estimate = OptimisePose(SmallCamera(), start, measurements);
  const Pose off = estimate.T_cam_world * kTruth.Inverse();
  EXPECT_GE(estimate.num_inliers, 90);
  EXPECT_LT(off.RotationAngle(), 2e-4);  // 0.1 px at f = 346 px are 2.9e-4, over 100 points
  EXPECT_LT(off.translation().norm(), 0.01);
}

TEST(OptimisePose, GuessedDepthsDoNotBiasTheTranslationThatKnownOnesHold) {
  std::mt19937 random(SeedFromTestName());
  const Eigen::Vector3d elsewhere = kTruth.Inverse().translation() + Eigen::Vector3d(0.3, 0, 0);
  std::vector<PointMeasurement> known = Measure(20, 0, 0.1, 1, random);
  for (PointMeasurement& m : known) m.sigma_px = 0.1;
  const std::vector<PointMeasurement> directions = MeasureDirections(200, elsewhere, random);
  const auto error_with = [&](const std::vector<PointMeasurement>& added) {
    std::vector<PointMeasurement> all = known;
    all.insert(all.end(), added.begin(), added.end());
    const Pose pose = OptimisePose(SmallCamera(), kTruth, all).T_cam_world;
    return (pose * kTruth.Inverse()).translation().norm();
  };
  EXPECT_LT(error_with(directions), 0.01);
  // Taken for known they do: the depths are 40 % off, so is the way from where they were seen.
  std::vector<PointMeasurement> taken_for_known = directions;
  for (PointMeasurement& m : taken_for_known) m.depth_axis.setZero();
  EXPECT_GT(error_with(taken_for_known), 0.05);
}

TEST(OptimisePose, FindsTheExactPoseWithoutNoise) {
  std::mt19937 random(SeedFromTestName());
  const auto measurements = Measure(50, 0, 0, 1, random);
  const PoseEstimate estimate = OptimisePose(SmallCamera(), Pose(), measurements);
  EXPECT_LT((estimate.T_cam_world.Matrix() - kTruth.Matrix()).norm(), 1e-6);
  EXPECT_EQ(estimate.num_inliers, 50);
}

TEST(OptimisePose, ConvergesWithThirtyPercentOutliers) {
  std::mt19937 random(SeedFromTestName());
  const auto measurements = Measure(200, 60, 0.5, 1, random);
  const PoseEstimate estimate = OptimisePose(SmallCamera(), Pose(), measurements);
  const Pose error = estimate.T_cam_world * kTruth.Inverse();
  EXPECT_LT(error.RotationAngle(), 0.002);      // 0.7 px of 345 over 140 points, with margin
  EXPECT_LT(error.translation().norm(), 0.02);  // the same at a depth of 10
  EXPECT_GE(estimate.num_inliers, 133);         // 95 % of 140
  EXPECT_LT(estimate.reprojection_px, 0.9);     // 0.5 px in x and y: 0.71
  EXPECT_GT(estimate.reprojection_px, 0.5);
  for (std::size_t i = 0; i < 60; ++i) EXPECT_EQ(estimate.is_inlier[i], 0) << i;
}

TEST(OptimisePose, IsTheSameAtAThousandTimesTheScale) {
  const auto run = [](double scale) {
    std::mt19937 random(SeedFromTestName());
    return OptimisePose(SmallCamera(), Pose(), Measure(100, 30, 0.5, scale, random));
  };
  const PoseEstimate small = run(1);
  const PoseEstimate large = run(1000);
  EXPECT_EQ(small.is_inlier, large.is_inlier);
  EXPECT_LT((small.T_cam_world.translation() - large.T_cam_world.translation() / 1000).norm(),
            1e-4);  // both have converged to 1e-6 of the cost
}

TEST(OptimisePose, SurvivesPointsBehindTheCamera) {
  std::mt19937 random(SeedFromTestName());
  auto measurements = Measure(50, 0, 0, 1, random);
  measurements[0].p_world = kTruth.Inverse() * Eigen::Vector3d(0, 0, -5);
  const PoseEstimate estimate = OptimisePose(SmallCamera(), kTruth, measurements);
  EXPECT_EQ(estimate.is_inlier[0], 0);
  EXPECT_EQ(estimate.num_inliers, 49);
}

TEST(OptimisePose, TellsTheNoiseBesideOutliers) {
  std::mt19937 random(SeedFromTestName());
  for (const double stated : {0.5, 0.1}) {
    constexpr double kNoise_px = 0.5;
    std::vector<PointMeasurement> measurements = Measure(400, 160, kNoise_px, 1, random);
    for (PointMeasurement& m : measurements) m.sigma_px = stated;
    const PoseEstimate estimate = OptimisePose(SmallCamera(), kTruth, measurements);
    // The quarter of least error of all is the 42 % of least error of those that are none: chi2 of
    // two dimensions 1.08 instead of 0.58.
    const double of_inliers = std::sqrt(1.08 / 0.5754);
    // A fifth more where most are outliers by what was stated, and the pose rests on few.
    EXPECT_NEAR(estimate.noise_scale, of_inliers * kNoise_px / stated,
                0.25 * of_inliers * kNoise_px / stated);
  }
}

TEST(NoiseScaleOf, IsOneOfNothingAndOfWhatWasStated) {
  EXPECT_EQ(NoiseScaleOf({}), 1);
  std::mt19937 random(SeedFromTestName());
  std::vector<double> chi2;
  for (int i = 0; i < 10000; ++i) {
    chi2.push_back(std::pow(Normal(random, 2), 2) + std::pow(Normal(random, 2), 2));
  }
  EXPECT_NEAR(NoiseScaleOf(chi2), 2, 0.06);
}

}  // namespace
}  // namespace mono3d::tracking
