// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/evaluation/cloud_registration.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "evaluation/cloud_scenes.h"
#include "mono3d/core/error.h"
#include "mono3d/evaluation/cloud_transform.h"

namespace mono3d {
namespace {

// Points are floats, 6e-8 of their place, and thousands of them average that out.
constexpr double kExactTolerance_m = 1e-5;  // of a scene 20 m wide: 5e-7 of it
// Two drawings of the same surfaces differ at edges, where planes are fitted around the corner.
constexpr double kOtherPointsTolerance_m = 0.03;
// A fifth of the points lifted by 5 m would lift their mean by 1 m.
constexpr double kWithOutliersTolerance_m = 0.1;
constexpr std::size_t kNumPoints = 8000;

TEST(CloudRegistration, BringsAMovedCloudBackExactly) {
  const PointCloud truth = HouseCloud(kNumPoints, 1);
  const Similarity S_estimate_truth = TestSimilarity(20, 0.05, {3, -2, 1});
  const PointCloud estimate = TransformCloud(S_estimate_truth, truth);
  const Similarity S_truth_estimate = S_estimate_truth.Inverse();
  // The start is off by half a degree and 1 %.
  const Similarity start = TestSimilarity(0.5, 1.01, {0.02, 0.03, -0.02}) * S_truth_estimate;
  const CloudRegistration registration = RegisterCloud(estimate, truth, start);
  EXPECT_TRUE(registration.converged()) << registration.reason;
  EXPECT_NEAR(registration.S_truth_estimate.scale() / S_truth_estimate.scale(), 1, 1e-6);
  EXPECT_LT(LargestCornerDistance(registration.S_truth_estimate * S_estimate_truth, Similarity()),
            kExactTolerance_m);
  EXPECT_EQ(registration.num_free_motions, 0);
}

TEST(CloudRegistration, RecoversThreeDegreesAndFivePercentOfScaleFromOtherPoints) {
  const PointCloud truth = HouseCloud(3 * kNumPoints, 2);
  for (const bool with_normals : {false, true}) {
    const PointCloud estimate = HouseCloud(2 * kNumPoints, 3, with_normals);
    const Similarity start = TestSimilarity(3, 1.05, {0.1, -0.1, 0.05});
    const CloudRegistration registration = RegisterCloud(estimate, truth, start);
    EXPECT_TRUE(registration.converged()) << registration.reason;
    EXPECT_NEAR(registration.S_truth_estimate.scale(), 1, 0.001);
    EXPECT_LT(LargestCornerDistance(registration.S_truth_estimate, Similarity()),
              kOtherPointsTolerance_m);
  }
}

TEST(CloudRegistration, KeepsTheScaleWhenRigid) {
  const PointCloud truth = HouseCloud(kNumPoints, 4);
  const Similarity start = TestSimilarity(3, 1.05, {0.1, -0.1, 0.05});
  const CloudRegistration rigid = RegisterCloudRigidly(truth, truth, start);
  EXPECT_DOUBLE_EQ(rigid.S_truth_estimate.scale(), 1.05);
  const CloudRegistration with_right_scale =
      RegisterCloudRigidly(truth, truth, TestSimilarity(3, 1, {0.1, -0.1, 0.05}));
  EXPECT_LT(LargestCornerDistance(with_right_scale.S_truth_estimate, Similarity()),
            kExactTolerance_m);
  EXPECT_LT(with_right_scale.residual_m, rigid.residual_m);
}

TEST(CloudRegistration, BearsThatEachHasPartsThatTheOtherLacks) {
  const PointCloud whole = HouseCloud(4 * kNumPoints, 5);
  PointCloud truth;
  for (const Eigen::Vector3f& point : whole.points) {
    if (point.x() < 5) truth.points.push_back(point);
  }
  PointCloud estimate;
  const PointCloud other = HouseCloud(2 * kNumPoints, 6);
  for (const Eigen::Vector3f& point : other.points) {
    if (point.x() > -6) estimate.points.push_back(point);
  }
  const CloudRegistration registration =
      RegisterCloud(estimate, truth, TestSimilarity(1.5, 1.02, {0.1, 0, 0.1}));
  EXPECT_TRUE(registration.converged()) << registration.reason;
  EXPECT_LT(LargestCornerDistance(registration.S_truth_estimate, Similarity()),
            kOtherPointsTolerance_m);
  EXPECT_LT(registration.inlier_share, 0.9);
}

TEST(CloudRegistration, IsNotDrawnAsideByOutliers) {
  const PointCloud truth = HouseCloud(3 * kNumPoints, 7);
  PointCloud estimate = HouseCloud(kNumPoints, 8);
  std::mt19937 random(9);
  std::uniform_real_distribution<float> height(1, 9);
  for (std::size_t i = 0; i < estimate.size(); i += 5) estimate.points[i].z() += height(random);
  const CloudRegistration registration =
      RegisterCloud(estimate, truth, TestSimilarity(1, 1.01, {0.1, 0, 0.1}));
  EXPECT_TRUE(registration.converged()) << registration.reason;
  EXPECT_LT(LargestCornerDistance(registration.S_truth_estimate, Similarity()),
            kWithOutliersTolerance_m);
}

TEST(CloudRegistration, LeavesMotionsThatAPlaneDoesNotResistAsTheyStart) {
  PointCloud plane;
  for (int i = 0; i < 3600; ++i) {
    plane.points.emplace_back(0.1F * static_cast<float>(i % 60), 0.1F * static_cast<float>(i / 60),
                              0.0F);
  }
  // 0.04 m along the plane, 0.03 m off it.
  const Similarity start(1, Pose(Eigen::Quaterniond::Identity(), {0.04, 0, 0.03}));
  const CloudRegistration rigid = RegisterCloudRigidly(plane, plane, start);
  EXPECT_TRUE(rigid.converged()) << rigid.reason;
  EXPECT_EQ(rigid.num_free_motions, 3);  // two ways along it and around its normal
  EXPECT_NEAR(rigid.S_truth_estimate.pose().translation().x(), 0.04, 1e-6);
  EXPECT_NEAR(rigid.S_truth_estimate.pose().translation().z(), 0, 1e-6);
  const CloudRegistration with_scale = RegisterCloud(plane, plane, start);
  EXPECT_EQ(with_scale.num_free_motions, 4);
  EXPECT_NEAR(with_scale.S_truth_estimate.scale(), 1, 1e-9);
}

// Noise that is larger than the relief fits the truth best where the estimate is a point.
TEST(CloudRegistration, KeepsTheScaleOfNoisyGroundThatIsAlmostFlat) {
  const auto field = [](unsigned seed, float noise_m) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> place(-30, 30);
    std::normal_distribution<float> noise(0, 1);
    PointCloud cloud;
    for (std::size_t i = 0; i < kNumPoints; ++i) {
      const float x = place(random);
      const float y = place(random);
      const float height = 0.05F * std::sin(0.3F * x) * std::cos(0.2F * y);
      cloud.points.emplace_back(x, y, height + noise_m * noise(random));
    }
    return cloud;
  };
  const CloudRegistration registration =
      RegisterCloud(field(1, 0.2F), field(2, 0), TestSimilarity(0.2, 1, {0.2, 0.1, 0.1}));
  EXPECT_TRUE(registration.converged()) << registration.reason;
  EXPECT_NEAR(registration.S_truth_estimate.scale(), 1, 1e-9);
  EXPECT_NEAR(registration.S_truth_estimate.pose().translation().z(), 0, 0.02);
}

TEST(CloudRegistration, IsTheSameInAWorldAThousandTimesAsLarge) {
  const PointCloud truth = HouseCloud(kNumPoints, 10);
  const PointCloud estimate = HouseCloud(kNumPoints, 11);
  const Similarity start = TestSimilarity(2, 1.03, {0.1, 0, 0.1});
  const Similarity grow(1000, Pose());
  const CloudRegistration small = RegisterCloud(estimate, truth, start);
  const CloudRegistration large =
      RegisterCloud(estimate, TransformCloud(grow, truth), grow * start);
  EXPECT_EQ(small.num_iterations, large.num_iterations);
  EXPECT_NEAR(large.S_truth_estimate.scale() / small.S_truth_estimate.scale(), 1000, 1e-3);
  EXPECT_NEAR(large.residual_m / small.residual_m, 1000, 1);
}

TEST(CloudRegistration, GivesTheSameTwice) {
  const PointCloud truth = HouseCloud(kNumPoints, 12);
  const PointCloud estimate = HouseCloud(kNumPoints, 13);
  const Similarity start = TestSimilarity(2, 1.03, {0.1, 0, 0.1});
  CloudRegistrationOptions options;
  options.max_points = 2000;
  const CloudRegistration first = RegisterCloud(estimate, truth, start, options);
  const CloudRegistration second = RegisterCloud(estimate, truth, start, options);
  EXPECT_LE(first.num_points, 2000);
  EXPECT_GE(first.num_points, 1400);
  EXPECT_EQ(first.S_truth_estimate.scale(), second.S_truth_estimate.scale());
  EXPECT_EQ(first.S_truth_estimate.pose().Matrix(), second.S_truth_estimate.pose().Matrix());
}

TEST(CloudRegistration, SaysThatThereIsNoOverlapAndKeepsTheStart) {
  const PointCloud truth = HouseCloud(kNumPoints, 14);
  const Similarity start = TestSimilarity(0, 1, {500, 0, 0});
  const CloudRegistration registration = RegisterCloud(truth, truth, start);
  EXPECT_EQ(registration.status, CloudRegistrationStatus::kNoOverlap);
  EXPECT_FALSE(registration.reason.empty());
  EXPECT_EQ(registration.S_truth_estimate.pose().translation(), start.pose().translation());
}

TEST(CloudRegistration, RefusesCloudsThatAreEmptyOrNotFinite) {
  const PointCloud house = HouseCloud(100, 15);
  PointCloud broken = house;
  broken.points[7].y() = std::numeric_limits<float>::quiet_NaN();
  PointCloud uneven = house;
  uneven.normals.resize(3);
  EXPECT_THROW(RegisterCloud({}, house, {}), Error);
  EXPECT_THROW(RegisterCloud(house, {}, {}), Error);
  EXPECT_THROW(RegisterCloud(broken, house, {}), Error);
  EXPECT_THROW(RegisterCloud(house, broken, {}), Error);
  EXPECT_THROW(RegisterCloud(uneven, house, {}), Error);
  CloudRegistrationOptions options;
  options.max_points = 0;
  EXPECT_THROW(RegisterCloud(house, house, {}, options), UsageError);
}

}  // namespace
}  // namespace mono3d
