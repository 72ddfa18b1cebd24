// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/scene_builder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "mono3d/core/error.h"

namespace mono3d::synthetic {
namespace {

// Small, so that many of them are built in a second.
SceneOptions SmallScene(const char* kind) {
  SceneOptions options;
  options.kind = kind;
  options.half_extent_m = 55;
  return options;
}

int CountMaterial(const Scene& scene, Material material) {
  const auto& surfaces = scene.mesh().surfaces;
  return static_cast<int>(
      std::count_if(surfaces.begin(), surfaces.end(),
                    [&](const Surface& surface) { return surface.material == material; }));
}

// Places of a lattice over the scene's middle.
template <typename Function>
void ForPlaces(Function&& function) {
  for (float y = -40; y <= 40; y += 5) {
    for (float x = -40; x <= 40; x += 5) function(Eigen::Vector2f(x + 0.3F, y + 0.7F));
  }
}

// Whatever is hit first from above is on the ground or higher.
void ExpectToStandOnGround(const Scene& scene) {
  constexpr float kBetweenGridPlaces_m = 0.6F;  // bumps that the height grid of 2 m misses
  constexpr float kBank_m = 5;                  // too steep for that grid
  int num_open = 0;
  ForPlaces([&](const Eigen::Vector2f& p) {
    const auto hit = scene.Intersect({{p.x(), p.y(), 300}, {0, 0, -1}});
    ASSERT_TRUE(hit.has_value());
    if (IsAtWater(scene.ground(), p, kBank_m)) return;
    const float above_m = hit->p.z() - GroundHeight(scene, p);
    EXPECT_GT(above_m, -kBetweenGridPlaces_m);
    if (hit->surface->material != Material::kGround) return;
    EXPECT_LT(above_m, kBetweenGridPlaces_m);
    ++num_open;
  });
  EXPECT_GT(num_open, 20);
}

TEST(BuildScene, EveryKindStandsOnItsGroundAndIsTheSameForTheSameSeed) {
  for (const char* kind : kSceneKinds) {
    SCOPED_TRACE(kind);
    SceneOptions options = SmallScene(kind);
    options.with_water = true;
    options.with_wires = true;
    const Scene a = BuildScene(options);
    ExpectToStandOnGround(a);
    for (const Eigen::Vector3f& vertex : a.mesh().vertices) ASSERT_TRUE(vertex.allFinite());
    const Scene b = BuildScene(options);
    EXPECT_EQ(a.mesh().vertices, b.mesh().vertices);
    EXPECT_EQ(a.mesh().triangles, b.mesh().triangles);
  }
}

TEST(BuildScene, AnotherSeedIsAnotherScene) {
  SceneOptions options = SmallScene("fields");
  const Scene a = BuildScene(options);
  options.seed = 2;
  EXPECT_NE(a.mesh().vertices, BuildScene(options).mesh().vertices);
}

TEST(BuildScene, WaterLiesLevelInItsBed) {
  SceneOptions options = SmallScene("fields");
  EXPECT_EQ(CountMaterial(BuildScene(options), Material::kWater), 0);
  options.half_extent_m = 100;
  options.with_water = true;
  const Scene scene = BuildScene(options);
  EXPECT_EQ(CountMaterial(scene, Material::kWater), 1);
  int num_wet = 0;
  for (float y = -90; y < -30; y += 1) {
    const auto hit = scene.Intersect({{3, y, 300}, {0, 0, -1}});
    ASSERT_TRUE(hit.has_value());
    if (hit->surface->material != Material::kWater) continue;
    ++num_wet;
    EXPECT_NEAR(hit->p.z(), scene.ground().water_level_m, 1e-3F);
    EXPECT_LT(GroundHeight(scene, {3, y}), hit->p.z());
  }
  EXPECT_GE(num_wet, 10);  // 13 m wide, on a slant
}

TEST(BuildScene, PanesMirrorOnDemand) {
  SceneOptions options = SmallScene("village");
  EXPECT_EQ(CountMaterial(BuildScene(options), Material::kMirrorGlass), 0);
  options.with_glass = true;
  const Scene scene = BuildScene(options);
  EXPECT_GT(CountMaterial(scene, Material::kMirrorGlass), 20);
  EXPECT_EQ(CountMaterial(scene, Material::kGlass), 0);
}

TEST(BuildScene, CarsDriveOnTheStreets) {
  SceneOptions options = SmallScene("fields");
  options.num_moving_cars = 3;
  Scene scene = BuildScene(options);
  ASSERT_TRUE(scene.HasMovingObjects());
  const auto places_of_cars = [&](double t_s) {
    scene.SetTimeSpan(t_s, t_s);
    std::vector<Eigen::Vector3f> places;
    for (float x = -58; x <= 58; x += 0.5F) {
      for (float y = 10; y <= 40; y += 0.5F) {
        const auto hit = scene.Intersect({{x, y, 300}, {0, 0, -1}});
        if (hit && hit->is_moving) places.push_back(hit->p);
      }
    }
    return places;
  };
  const auto now = places_of_cars(0);
  // A car of 4.3 m by 1.75 m covers some 30 places.
  EXPECT_GT(now.size(), 50U);
  for (const Eigen::Vector3f& p : now) {
    EXPECT_LT(scene.ground().streets.At(p.head<2>()), kStreetHalfWidth_m);
    EXPECT_LT(p.z() - GroundHeight(scene, p.head<2>()), 2);
  }
  EXPECT_NE(now, places_of_cars(1));
  EXPECT_EQ(now, places_of_cars(0));
}

TEST(BuildScene, RefusesBadOptions) {
  SceneOptions options;
  options.kind = "castle";
  EXPECT_THROW(BuildScene(options), UsageError);
  options = {};
  options.half_extent_m = 10;
  EXPECT_THROW(BuildScene(options), UsageError);
  options = {};
  options.num_moving_cars = -1;
  EXPECT_THROW(BuildScene(options), UsageError);
}

}  // namespace
}  // namespace mono3d::synthetic
