// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/shading.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "mono3d/core/error.h"
#include "synthetic/light.h"

namespace mono3d::synthetic {
namespace {

using Eigen::Vector3f;

constexpr float kPixelWidth = 1e-3F;
const Vector3f kRed(0.6F, 0.05F, 0.05F);

// A floor at z = 0 of the given material; a red wall at y = 10, 40 m high.
Scene FloorBeforeRedWall(Material material) {
  Mesh mesh;
  AddParallelogram(mesh, {{-50, -50, 0}, {100, 0, 0}, {0, 60, 0}},
                   {material, Vector3f::Constant(0.05F), 3});
  AddParallelogram(mesh, {{-50, 10, 0}, {100, 0, 0}, {0, 0, 40}}, {Material::kPaint, kRed, 0});
  return Scene(std::move(mesh));
}

// Looks down on the floor at 45 degrees, towards the wall that stands 10 m behind that place.
Vector3f SeenOn(Material material) {
  const Vector3f towards = Vector3f(0, 1, -1).normalized();
  return Radiance(FloorBeforeRedWall(material), {-10 * towards, towards}, kPixelWidth);
}

float Redness(const Vector3f& colour) { return colour[0] - colour[2]; }

TEST(Shading, WaterAndPanesMirrorWhatStandsOpposite) {
  const float matt = Redness(SeenOn(Material::kPaint));
  EXPECT_GT(Redness(SeenOn(Material::kMirrorGlass)), matt + 0.02F);
  EXPECT_GT(Redness(SeenOn(Material::kWater)), matt + 0.005F);
  EXPECT_NEAR(Redness(SeenOn(Material::kGlass)), matt, 0.02F);
}

TEST(Reflectance, GrowsTowardsGrazingAndIsNoneOnMattSurfaces) {
  EXPECT_NEAR(Reflectance(Material::kWater, 1), 0.02F, 1e-6F);
  EXPECT_NEAR(Reflectance(Material::kWater, 0), 1, 1e-6F);
  EXPECT_GT(Reflectance(Material::kWater, 0.2F), Reflectance(Material::kWater, 0.5F));
  EXPECT_EQ(Reflectance(Material::kPlaster, 0.1F), 0);
}

TEST(RippleSlope, IsGentleAndGoneWhereAPixelCannotResolveIt) {
  const Surface water{.material = Material::kWater};
  EXPECT_EQ(RippleSlope(water, {1.3F, 2.1F}, 5), Eigen::Vector2f::Zero());
  EXPECT_GT(RippleSlope(water, {1.3F, 2.1F}, 0.01F).norm(), 0);
  EXPECT_LT(RippleSlope(water, {1.3F, 2.1F}, 0.01F).norm(), 0.2F);
}

TEST(Shading, HazeHidesWhatIsFar) {
  Scene scene = FloorBeforeRedWall(Material::kPaint);
  const Ray ray{{0, -40, 20}, Vector3f::UnitY()};  // 50 m from the wall
  const Vector3f clear = Radiance(scene, ray, kPixelWidth);
  Light light;
  light.visibility_m = 50;
  scene.set_light(light);
  const Vector3f hazy = Radiance(scene, ray, kPixelWidth);
  const Vector3f expected = 0.02F * clear + 0.98F * light.horizon;
  EXPECT_NEAR((hazy - expected).norm(), 0, 1e-3F);
}

TEST(Albedo, BareWallHasHardlyAnyTexture) {
  constexpr float kContrast = 0.03F;  // of the mean: plaster has some 20 %
  const Surface bare{.material = Material::kBareWall, .seed = 5};
  const Surface plaster{.material = Material::kPlaster, .seed = 5};
  float bare_range = 0;
  float plaster_range = 0;
  for (int i = 0; i < 200; ++i) {
    const Vector3f p(0.37F * static_cast<float>(i), 0.21F * static_cast<float>(i), 0);
    const auto relative = [&](const Surface& surface) {
      return std::abs(Albedo(surface, nullptr, p, 0.05F).x() / surface.colour.x() - 1);
    };
    bare_range = std::max(bare_range, relative(bare));
    plaster_range = std::max(plaster_range, relative(plaster));
  }
  EXPECT_LT(bare_range, kContrast);
  EXPECT_GT(plaster_range, 3 * kContrast);
}

TEST(MakeLight, DefaultOptionsAreTheDefaultLight) {
  constexpr float kRoundedAngles = 0.01F;  // the options are given in whole and half degrees
  const Light made = MakeLight({});
  const Light expected;
  EXPECT_NEAR((made.to_sun - expected.to_sun).norm(), 0, kRoundedAngles);
  EXPECT_NEAR((made.sun - expected.sun).norm(), 0, kRoundedAngles);
  EXPECT_NEAR((made.sky - expected.sky).norm(), 0, kRoundedAngles);
  EXPECT_EQ(Transmittance(made, 1e4F), 1);
}

TEST(MakeLight, LowSunIsRedder) {
  LightOptions low;
  low.sun_elevation_deg = 8;
  const Light evening = MakeLight(low);
  const Light day = MakeLight({});
  EXPECT_GT(evening.sun[0] / evening.sun[2], 1.3F * day.sun[0] / day.sun[2]);
  EXPECT_NEAR(evening.to_sun.z(), std::sin(8 * 3.14159265F / 180), 1e-5F);
}

TEST(MakeLight, OvercastSkyLeavesNoSun) {
  LightOptions options;
  options.overcast = 1;
  EXPECT_EQ(MakeLight(options).sun, Vector3f::Zero());
  EXPECT_GT(MakeLight(options).sky.minCoeff(), Light().sky.maxCoeff());
}

TEST(LightOptions, RefuseBadValues) {
  LightOptions options;
  options.sun_elevation_deg = 1;
  EXPECT_THROW(MakeLight(options), UsageError);
  options = {};
  options.visibility_m = -3;
  EXPECT_THROW(MakeLight(options), UsageError);
  options = {};
  options.overcast = 1.5;
  EXPECT_THROW(MakeLight(options), UsageError);
}

}  // namespace
}  // namespace mono3d::synthetic
