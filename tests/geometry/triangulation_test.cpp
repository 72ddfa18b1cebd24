// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/triangulation.h"

#include <gtest/gtest.h>

#include <random>

#include "geometry/two_view_world.h"

namespace mono3d {
namespace {

constexpr double kTriangulationRounding = 1e-9;  // relative, of a 4x4 eigenvector

TEST(Triangulate, FindsAPointWorkedOutByHand) {
  // Camera b stands 1 to the right; the point at (1, 0.5, 2) is straight ahead of it.
  const Pose T_b_a(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-1, 0, 0));
  const auto p_a = Triangulate({0.5, 0.25, 1}, {0, 0.25, 1}, T_b_a);
  ASSERT_TRUE(p_a.has_value());
  EXPECT_LT((*p_a - Eigen::Vector3d(1, 0.5, 2)).norm(), kTriangulationRounding);
}

TEST(Triangulate, RefusesAPointBehindTheCameras) {
  const Pose T_b_a(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-1, 0, 0));
  EXPECT_FALSE(Triangulate({-0.5, 0.25, 1}, {0, 0.25, 1}, T_b_a).has_value());
}

TEST(Triangulate, RefusesParallelRays) {
  const Pose T_b_a(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-1, 0, 0));
  const auto p_a = Triangulate({0, 0, 1}, {0, 0, 1}, T_b_a);
  // Rounding may leave a point at the end of the world.
  EXPECT_TRUE(!p_a || p_a->norm() > 1e12);
}

TEST(Triangulate, RecoversRandomPointsAtAnyScale) {
  std::mt19937 random(SeedFromTestName());
  const TwoViewWorld world = MakeTwoViewWorld({}, random);
  for (const double scale : {1.0, 1000.0}) {
    const Pose T_b_a(world.T_b_a.rotation(), scale * world.T_b_a.translation());
    for (std::size_t i = 0; i < world.pairs.size(); ++i) {
      const auto p_a = Triangulate(world.camera.Unproject(world.pairs[i].a),
                                   world.camera.Unproject(world.pairs[i].b), T_b_a);
      ASSERT_TRUE(p_a.has_value());
      const Eigen::Vector3d truth = scale * world.p_a[i];
      EXPECT_LT((*p_a - truth).norm(), 1e-6 * truth.norm());  // conditioning of 1.4 in 20
    }
  }
}

TEST(CosParallax, IsThatOfTheAngleAtThePoint) {
  const Eigen::Vector3d point(0, 0, 1);
  EXPECT_NEAR(CosParallax(point, {0, 0, 0}, {1, 0, 0}), std::sqrt(0.5), 1e-15);
  EXPECT_NEAR(CosParallax(point, {1, 0, 1}, {-3, 0, 1}), -1, 1e-15);
}

}  // namespace
}  // namespace mono3d
