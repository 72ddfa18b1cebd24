// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/scene.h"

#include <gtest/gtest.h>

#include <limits>
#include <utility>
#include <vector>

#include "mono3d/core/error.h"

namespace mono3d::synthetic {
namespace {

using Eigen::Vector3f;

constexpr float kRounding_m = 1e-4F;  // single precision at some 10 m
constexpr float kSpeed_m_s = 10;

// A floor of 100 m at z = 0, and a cube of 2 m on it that drives along x from the origin.
Scene FloorWithDrivingCube() {
  Mesh floor;
  AddParallelogram(floor, {{-50, -50, 0}, {100, 0, 0}, {0, 100, 0}}, {});
  MovingObject cube;
  AddBlock(cube.mesh, CentredBlock({0, 0, 1}, {2, 0, 0}, {0, 2, 0}, {0, 0, 2}), {});
  cube.T_world_object = [](double t_s) {
    Eigen::Isometry3f pose = Eigen::Isometry3f::Identity();
    pose.translation().x() = kSpeed_m_s * static_cast<float>(t_s);
    return pose;
  };
  std::vector<MovingObject> moving;
  moving.push_back(std::move(cube));
  return Scene(std::move(floor), {}, std::move(moving));
}

Hit Below(const Scene& scene, float x, float time_s = 0) {
  const auto hit = scene.Intersect({{x, 0.3F, 20}, {0, 0, -1}, time_s});
  EXPECT_TRUE(hit.has_value());
  return hit.value();
}

TEST(Scene, MovingObjectIsWhereItsPoseSays) {
  Scene scene = FloorWithDrivingCube();
  EXPECT_TRUE(scene.HasMovingObjects());
  EXPECT_NEAR(Below(scene, 0).p.z(), 2, kRounding_m);
  EXPECT_TRUE(Below(scene, 0).is_moving);
  EXPECT_FALSE(Below(scene, 10).is_moving);
  scene.SetTimeSpan(1, 1);
  EXPECT_NEAR(Below(scene, 0).p.z(), 0, kRounding_m);
  EXPECT_FALSE(Below(scene, 0).is_moving);
  EXPECT_NEAR(Below(scene, 10).p.z(), 2, kRounding_m);
}

TEST(Scene, MovesWhileTheShutterIsOpen) {
  Scene scene = FloorWithDrivingCube();
  scene.SetTimeSpan(1, 2);
  EXPECT_TRUE(Below(scene, 10, 1).is_moving);
  EXPECT_TRUE(Below(scene, 15, 1.5F).is_moving);
  EXPECT_FALSE(Below(scene, 15, 1).is_moving);
  EXPECT_TRUE(Below(scene, 20, 7).is_moving);  // beyond the span: as at its end
  EXPECT_TRUE(scene.IsOccluded({{15, 0, 0.01F}, {0, 0, 1}, 1.5F}));
  EXPECT_FALSE(scene.IsOccluded({{15, 0, 0.01F}, {0, 0, 1}, 1}));
}

TEST(Scene, TextureTravelsWithItsObject) {
  Scene scene = FloorWithDrivingCube();
  const Vector3f before = Below(scene, 0.4F).p_surface;
  scene.SetTimeSpan(2, 2);
  const Hit hit = Below(scene, 20.4F);
  EXPECT_NEAR((hit.p_surface - before).norm(), 0, kRounding_m);
  EXPECT_NEAR((hit.normal - Vector3f::UnitZ()).norm(), 0, kRounding_m);
}

TEST(Scene, ObjectThatIsPutElsewhereDoesNotFlyThere) {
  Scene scene = FloorWithDrivingCube();
  scene.SetTimeSpan(0, 9);  // 90 m on, beyond what a shutter sees
  EXPECT_TRUE(Below(scene, 0, 4.5F).is_moving);
  EXPECT_FALSE(Below(scene, 45, 4.5F).is_moving);
}

TEST(Scene, RefusesATimeSpanThatEndsBeforeItBegins) {
  Scene scene = FloorWithDrivingCube();
  EXPECT_THROW(scene.SetTimeSpan(1, 0.5), Error);
  EXPECT_THROW(scene.SetTimeSpan(0, std::numeric_limits<double>::quiet_NaN()), Error);
}

}  // namespace
}  // namespace mono3d::synthetic
