// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/pose.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "geometry/two_view_world.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

constexpr double kPoseRounding = 1e-12;  // a few operations in double precision on numbers near 1

Pose RandomPose(std::mt19937& random) {
  const auto number = [&] { return Uniform(random, -1.5, 1.5); };
  return {RotationExp({number(), number(), number()}),
          Eigen::Vector3d(number(), number(), number())};
}

TEST(Pose, QuarterTurnAboutZMapsXToY) {
  const Pose T(RotationExp({0, 0, std::numbers::pi / 2}), Eigen::Vector3d(0, 0, 5));
  EXPECT_LT((T * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(0, 1, 5)).norm(), kPoseRounding);
  EXPECT_NEAR(T.RotationAngle(), std::numbers::pi / 2, kPoseRounding);
}

TEST(Pose, TimesItsInverseIsIdentity) {
  std::mt19937 random(SeedFromTestName());
  for (int i = 0; i < 20; ++i) {
    const Pose T = RandomPose(random);
    EXPECT_LT(((T * T.Inverse()).Matrix() - Eigen::Matrix4d::Identity()).norm(), kPoseRounding);
  }
}

TEST(Pose, ProductMapsAsOneAfterTheOther) {
  std::mt19937 random(SeedFromTestName());
  const Pose T_a_b = RandomPose(random);
  const Pose T_b_c = RandomPose(random);
  const Eigen::Vector3d p_c(0.3, -2, 1);
  EXPECT_LT(((T_a_b * T_b_c) * p_c - T_a_b * (T_b_c * p_c)).norm(), kPoseRounding);
  EXPECT_LT(((T_a_b * T_b_c).Matrix() - T_a_b.Matrix() * T_b_c.Matrix()).norm(), kPoseRounding);
}

TEST(Pose, NormalisesTheRotation) {
  const Pose T(Eigen::Quaterniond(2, 0, 0, 0), Eigen::Vector3d::Zero());
  EXPECT_NEAR(T.rotation().norm(), 1, kPoseRounding);
}

TEST(Pose, IsTakenOverBitForBit) {
  int num_changed_by_normalising = 0;
  Pose pose(RotationExp({0.3, -0.2, 1}), {1, 2, 3});
  for (int i = 0; i < 100; ++i) {
    pose = Pose(RotationExp({0.01 * i, 0.2, -0.1}), {0.1, 0, 0}) * pose;
    const Pose again = Pose::Exactly(pose.rotation(), pose.translation());
    EXPECT_EQ(again.rotation().coeffs(), pose.rotation().coeffs());
    EXPECT_EQ(again.translation(), pose.translation());
    const Pose normalised(pose.rotation(), pose.translation());
    num_changed_by_normalising +=
        normalised.rotation().coeffs() == pose.rotation().coeffs() ? 0 : 1;
  }
  EXPECT_GT(num_changed_by_normalising, 0);  // or there were no need for it
  const Eigen::Quaterniond no_unit(1, 0.001, 0, 0);
  EXPECT_THROW((void)Pose::Exactly(no_unit, {0, 0, 0}), Error);
  const Eigen::Quaterniond none(std::nan(""), 0, 0, 0);
  EXPECT_THROW((void)Pose::Exactly(none, {0, 0, 0}), Error);
}

TEST(RotationLog, InvertsRotationExp) {
  for (const double angle : {0.0, 1e-9, 1e-5, 0.3, 3.0}) {
    const Eigen::Vector3d omega = angle * Eigen::Vector3d(2, -1, 2) / 3;
    EXPECT_LT((RotationLog(RotationExp(omega)) - omega).norm(), kPoseRounding) << angle;
  }
}

TEST(RotationLog, TakesTheShorterWayRound) {
  const Eigen::Quaterniond q = RotationExp({0.4, 0, 0});
  const Eigen::Quaterniond opposite(-q.w(), -q.x(), -q.y(), -q.z());
  EXPECT_LT((RotationLog(opposite) - Eigen::Vector3d(0.4, 0, 0)).norm(), kPoseRounding);
}

TEST(Pose, RefusesAMatrixThatIsNoRotation) {
  const Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  const Eigen::Matrix3d R = RotationExp({0.3, -0.2, 1}).toRotationMatrix();
  EXPECT_NO_THROW(Pose(R, origin));
  EXPECT_THROW(Pose(Eigen::Matrix3d(1.01 * R), origin), Error);  // scaled
  EXPECT_THROW(Pose(Eigen::Matrix3d(-R), origin), Error);        // mirrored
  EXPECT_THROW(Pose(Eigen::Matrix3d(std::nan("") * R), origin), Error);
  Eigen::Matrix3d sheared = R;
  sheared(0, 1) += 0.001;
  EXPECT_THROW(Pose(sheared, origin), Error);
}

}  // namespace
}  // namespace mono3d
