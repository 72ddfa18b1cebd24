// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/fundamental.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "geometry/two_view_world.h"

namespace mono3d {
namespace {

TEST(FundamentalFromMotion, HasTheEpipolarLinesOfASidewaysStep) {
  const Pose T_b_a(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-1, 0, 0));
  const Eigen::Matrix3d K = Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d F = FundamentalFromMotion(T_b_a, K, K);
  // The line of (3, 4) is y = 4: (8, 6) is 2 away from it.
  EXPECT_NEAR(SquaredEpipolarDistance(F, {3, 4}, {8, 6}), 4, 1e-12);
}

TEST(FitFundamental, AgreesWithTheMotionOnExactPairs) {
  std::mt19937 random(SeedFromTestName());
  const TwoViewWorld world = MakeTwoViewWorld({}, random);
  const auto F = FitFundamental(world.pairs);
  ASSERT_TRUE(F.has_value());
  const Eigen::Matrix3d K = world.camera.Matrix();
  Eigen::Matrix3d truth = FundamentalFromMotion(world.T_b_a, K, K).normalized();
  if ((truth.array() * F->array()).sum() < 0) truth = -truth;
  EXPECT_LT((*F - truth).norm(), 1e-6);
  EXPECT_LT(std::abs(F->determinant()), 1e-12);  // rank 2
}

TEST(FitFundamental, RefusesAPlaneAndTooFewPairs) {
  std::mt19937 random(SeedFromTestName());
  const TwoViewWorld plane = MakeTwoViewWorld({.planar = true}, random);
  EXPECT_FALSE(FitFundamental(plane.pairs).has_value());
  const TwoViewWorld seven = MakeTwoViewWorld({.num_points = 7}, random);
  EXPECT_FALSE(FitFundamental(seven.pairs).has_value());
}

TEST(DecomposeEssential, HoldsTheMotionUpToItsLength) {
  std::mt19937 random(SeedFromTestName());
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  for (int trial = 0; trial < 20; ++trial) {
    const auto number = [&] { return Uniform(random, -1, 1); };
    const Pose T_b_a(RotationExp({number(), number(), number()}),
                     Eigen::Vector3d(number(), number(), number()).normalized());
    const Eigen::Matrix3d E = FundamentalFromMotion(T_b_a, I, I);
    double smallest = 10;
    for (const Pose& motion : DecomposeEssential(-7 * E)) {
      smallest = std::min(smallest, (motion.Matrix() - T_b_a.Matrix()).norm());
    }
    EXPECT_LT(smallest, 1e-9);
  }
}

}  // namespace
}  // namespace mono3d
