// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/homography.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <random>
#include <vector>

#include "geometry/two_view_world.h"

namespace mono3d {
namespace {

constexpr double kEigenvectorRounding = 1e-8;  // of an eigenvector problem of squared pixels

TEST(FitHomography, FindsAShiftFromFourCorners) {
  std::vector<PointPair> pairs;
  for (const auto& [x, y] : {std::pair{0.0, 0.0}, {1.0, 0.0}, {1.0, 1.0}, {0.0, 1.0}}) {
    pairs.push_back({{x, y}, {x + 5, y - 2}});
  }
  const auto H = FitHomography(pairs);
  ASSERT_TRUE(H.has_value());
  Eigen::Matrix3d shift;
  shift << 1, 0, 5, 0, 1, -2, 0, 0, 1;
  EXPECT_LT((*H / (*H)(2, 2) - shift).norm(), kEigenvectorRounding);
}

TEST(FitHomography, RefusesPointsOnALineAndTooFew) {
  std::vector<PointPair> on_a_line;
  for (int i = 0; i < 8; ++i) on_a_line.push_back({{i, 2.0 * i}, {3.0 * i, i}});
  EXPECT_FALSE(FitHomography(on_a_line).has_value());
  EXPECT_FALSE(FitHomography(std::vector<PointPair>(on_a_line.begin(), on_a_line.begin() + 3)));
}

TEST(FitHomography, MapsThePointsOfAPlane) {
  std::mt19937 random(SeedFromTestName());
  const TwoViewWorld world = MakeTwoViewWorld({.planar = true}, random);
  const auto H = FitHomography(world.pairs);
  ASSERT_TRUE(H.has_value());
  for (const PointPair& pair : world.pairs) {
    EXPECT_LT(((*H * pair.a.homogeneous()).hnormalized() - pair.b).norm(), 1e-6);
  }
}

// Both solutions reproduce H; one of them is the motion.
TEST(DecomposeHomography, HoldsTheMotionAndThePlane) {
  std::mt19937 random(SeedFromTestName());
  for (int trial = 0; trial < 20; ++trial) {
    const auto number = [&] { return Uniform(random, -0.3, 0.3); };
    const Pose T_b_a(RotationExp({number(), number(), number()}),
                     Eigen::Vector3d(number(), number(), number()));
    const Eigen::Vector3d normal = Eigen::Vector3d(number(), number(), 1).normalized();
    const Eigen::Matrix3d H =
        T_b_a.rotation().toRotationMatrix() + T_b_a.translation() * normal.transpose();
    const double scale = trial % 2 == 0 ? 3.0 : -0.2;  // H is known up to any factor
    const std::vector<PlaneMotion> motions = DecomposeHomography(scale * H);
    ASSERT_EQ(motions.size(), 2U);
    double smallest = 1;
    for (const PlaneMotion& motion : motions) {
      const Eigen::Matrix3d again = motion.T_b_a.rotation().toRotationMatrix() +
                                    motion.T_b_a.translation() * motion.normal_a.transpose();
      EXPECT_LT((again - H).norm(), kEigenvectorRounding);
      smallest = std::min(smallest, (motion.T_b_a.Matrix() - T_b_a.Matrix()).norm() +
                                        (motion.normal_a - normal).norm());
    }
    EXPECT_LT(smallest, 1e-6);  // eigenvectors of close eigenvalues
  }
}

TEST(DecomposeHomography, FindsNoTranslationInARotation) {
  EXPECT_TRUE(DecomposeHomography(RotationExp({0.1, 0.2, 0.3}).toRotationMatrix()).empty());
  EXPECT_TRUE(DecomposeHomography(Eigen::Matrix3d::Zero()).empty());
}

}  // namespace
}  // namespace mono3d
