// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/material.h"

#include <algorithm>
#include <cmath>

#include "synthetic/noise.h"
#include "synthetic/numbers.h"

namespace mono3d::synthetic {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

// A place on a surface: in the world, and along the texture's axes.
struct Place {
  Vector3f p;
  Vector2f uv;
  float footprint_m;
};

// 0 below -width, 1 above +width: an edge no sharper than the pixel.
float Step(float distance_m, float width_m) {
  const float t = std::clamp(0.5F + 0.5F * distance_m / width_m, 0.0F, 1.0F);
  return t * t * (3 - 2 * t);
}

Vector3f Modulated(const Vector3f& colour, float log_factor) {
  return colour * std::exp(log_factor);
}

// A wall of rectangles: which one a place is in, and how far into its joint.
struct Tiling {
  float shade;    // random per tile, -1 to 1, 0 when tiles are not resolved
  float joint;    // 1 in the joint, 0 on the tile, its mean when not resolved
  float along_v;  // 0 to 1 across the tile
};

Tiling TileAt(const Vector2f& uv, const Vector2f& size_m, float joint_m, const Place& place,
              std::uint32_t seed) {
  const float row = std::floor(uv.y() / size_m.y());
  const float shift = 0.5F * std::fmod(std::abs(row), 2.0F);  // running bond
  const float column_place = uv.x() / size_m.x() + shift;
  const float column = std::floor(column_place);
  const float s = column_place - column;
  const float t = uv.y() / size_m.y() - row;
  const float share = ResolvedShare(size_m.minCoeff(), place.footprint_m);
  const float mean_joint = joint_m / size_m.minCoeff();
  const float from_edge_m =
      std::min(std::min(s, 1 - s) * size_m.x(), std::min(t, 1 - t) * size_m.y());
  const float joint = 1 - Step(from_edge_m - joint_m / 2, std::max(place.footprint_m / 2, 0.005F));
  const float shade = 2 * HashUnit(static_cast<int>(column), static_cast<int>(row), 7, seed) - 1;
  return {shade * share, mean_joint + share * (joint - mean_joint), t};
}

Vector3f TestPattern(const Surface& surface, const Place& place) {
  Vector3f colour = surface.colour;
  for (int i = 0; i < 3; ++i) {
    const FractalOptions tint{6, 0.5F, 0.9F,
                              surface.seed + 100U * static_cast<std::uint32_t>(i + 1)};
    colour[i] *= std::exp(0.35F * FractalNoise(place.p, tint, place.footprint_m));
  }
  const FractalOptions detail{4, 0, 1, surface.seed};
  return Modulated(colour, 0.6F * FractalNoise(place.p, detail, place.footprint_m));
}

Vector3f Plaster(const Surface& surface, const Place& place) {
  const Vector2f streaks(place.uv.x(), 0.2F * place.uv.y());
  const float stain = FractalNoise(streaks, {2, 0, 0.8F, surface.seed}, place.footprint_m);
  const float grain = FractalNoise(place.uv, {0.8F, 0, 1, surface.seed + 50}, place.footprint_m);
  return Modulated(surface.colour, 0.2F * stain + 0.12F * grain);
}

Vector3f Stone(const Surface& surface, const Place& place) {
  const Tiling tile = TileAt(place.uv, {0.7F, 0.4F}, 0.05F, place, surface.seed);
  const float grain = FractalNoise(place.uv, {1.5F, 0, 0.9F, surface.seed}, place.footprint_m);
  return Modulated(surface.colour, 0.3F * tile.shade - 0.5F * tile.joint + 0.25F * grain);
}

Vector3f RoofTiles(const Surface& surface, const Place& place) {
  const Tiling tile = TileAt(place.uv, {0.4F, 0.45F}, 0.06F, place, surface.seed);
  const float moss = FractalNoise(place.uv, {3, 0, 0.8F, surface.seed + 9}, place.footprint_m);
  const Vector3f colour =
      Mix(surface.colour, {0.09F, 0.1F, 0.05F}, std::clamp(0.8F * moss - 0.25F, 0.0F, 0.7F));
  const float grain = FractalNoise(place.uv, {1, 0, 1, surface.seed}, place.footprint_m);
  return Modulated(colour, 0.38F * tile.shade - 0.7F * tile.joint + 0.22F * grain);
}

Vector3f Glass(const Surface& surface, const Place& place) {
  // Curtains and what is behind the pane; reflection, where there is any, is shading.
  const float behind = FractalNoise(place.uv, {0.7F, 0, 0.8F, surface.seed}, place.footprint_m);
  return Modulated(surface.colour, 0.8F * behind);
}

Vector3f Wood(const Surface& surface, const Place& place) {
  const Tiling plank = TileAt(place.uv, {0.25F, 4}, 0.02F, place, surface.seed);
  const Vector2f fibre(place.uv.x(), 0.1F * place.uv.y());
  const float grain = FractalNoise(fibre, {0.6F, 0, 0.9F, surface.seed}, place.footprint_m);
  return Modulated(surface.colour, 0.3F * plank.shade - 0.6F * plank.joint + 0.3F * grain);
}

Vector3f Foliage(const Surface& surface, const Place& place) {
  const float leaves = FractalNoise(place.p, {2.5F, 0, 1, surface.seed}, place.footprint_m);
  const float hue = GradientNoise(Vector3f(place.p / 1.7F), surface.seed + 77);
  const Vector3f colour = surface.colour.cwiseProduct(Vector3f(1 + 0.5F * hue, 1, 1 - 0.3F * hue));
  return Modulated(colour, 0.75F * leaves);
}

Vector3f Soil(const Surface& surface, const Place& place) {
  constexpr float kRow_m = 0.6F;
  const float rows =
      std::sin(6.2831853F * place.uv.y() / kRow_m) * ResolvedShare(kRow_m / 2, place.footprint_m);
  const float clods = FractalNoise(place.uv, {1, 0, 1, surface.seed}, place.footprint_m);
  const Vector3f plants(0.07F, 0.16F, 0.04F);
  return Modulated(Mix(surface.colour, plants, std::clamp(0.4F + 0.6F * rows, 0.0F, 1.0F)),
                   0.5F * clods);
}

Vector3f Gravel(const Vector3f& colour, const Place& place, std::uint32_t seed) {
  const float stones = FractalNoise(place.uv, {3, 0, 1, seed}, place.footprint_m);
  return Modulated(colour, 0.33F * stones);
}

Vector3f BareWall(const Surface& surface, const Place& place) {
  const float stain = FractalNoise(place.uv, {9, 1, 0.7F, surface.seed}, place.footprint_m);
  return Modulated(surface.colour, 0.02F * stain);
}

Vector3f Asphalt(const Place& place, std::uint32_t seed) {
  const float wear = FractalNoise(place.uv, {7, 0, 0.85F, seed}, place.footprint_m);
  // A patch where the street was opened: cells of a coarse lattice, a few of them darker.
  const Tiling patch = TileAt(place.uv, {5, 2.2F}, 0.1F, place, seed + 1);
  const float darker = patch.shade > 0.6F ? -0.4F : 0.0F;
  return Modulated({0.13F, 0.13F, 0.14F}, 0.33F * wear + darker);
}

Vector3f Meadow(const Place& place, std::uint32_t seed) {
  const float dry = FractalNoise(place.uv, {22, 0, 0.75F, seed + 3}, place.footprint_m);
  const Vector3f colour =
      Mix({0.075F, 0.14F, 0.03F}, {0.27F, 0.25F, 0.1F}, std::clamp(0.35F + 0.5F * dry, 0.0F, 1.0F));
  const float blades = FractalNoise(place.uv, {4, 0, 1, seed + 4}, place.footprint_m);
  return Modulated(colour, 0.4F * blades);
}

// Fields of 60 m x 35 m, each with its own crop in rows.
Vector3f Field(const Place& place, std::uint32_t seed) {
  const Vector2f turned(0.94F * place.uv.x() + 0.34F * place.uv.y(),
                        -0.34F * place.uv.x() + 0.94F * place.uv.y());
  const int column = static_cast<int>(std::floor(turned.x() / 60));
  const int row = static_cast<int>(std::floor(turned.y() / 35));
  const float crop = HashUnit(column, row, 1, seed);
  if (crop < 0.35F) return Meadow(place, seed + 20);
  const Vector3f colour = crop < 0.6F   ? Vector3f(0.3F, 0.25F, 0.09F)
                          : crop < 0.8F ? Vector3f(0.17F, 0.11F, 0.07F)
                                        : Vector3f(0.09F, 0.17F, 0.04F);
  const float row_m = 0.8F + 0.9F * HashUnit(column, row, 2, seed);
  const float along = HashUnit(column, row, 3, seed) < 0.5F ? turned.x() : turned.y();
  const float rows =
      std::sin(6.2831853F * along / row_m) * ResolvedShare(row_m / 2, place.footprint_m);
  const float grain = FractalNoise(place.uv, {6, 0, 1, seed + 30}, place.footprint_m);
  return Modulated(colour, 0.25F * rows + 0.4F * grain);
}

Vector3f Ground(const GroundMap& ground, const Place& place) {
  const float edge = 0.3F * GradientNoise(Vector2f(place.uv / 0.9F), ground.seed + 60);
  const float street_m = ground.streets.At(place.uv);
  const float path_m = ground.paths.At(place.uv) + edge;
  const float width_m = std::max(place.footprint_m / 2, 0.02F);
  if (street_m < kStreetHalfWidth_m - width_m) return Asphalt(place, ground.seed + 40);
  const float field_edge_m = 32 + 6 * GradientNoise(Vector2f(place.uv / 25), ground.seed + 61);
  const bool is_field = street_m > field_edge_m && place.uv.norm() > ground.lawn_radius_m;
  Vector3f colour = is_field ? Field(place, ground.seed + 10) : Meadow(place, ground.seed + 11);
  const float path_share = 1 - Step(path_m - kPathHalfWidth_m, 2 * width_m);
  if (path_share > 0) {
    colour = Mix(colour, Gravel({0.3F, 0.27F, 0.22F}, place, ground.seed + 12), path_share);
  }
  const float pavement_m = street_m - kStreetHalfWidth_m - kPavementWidth_m + 0.5F * edge;
  const float pavement_share = 1 - Step(pavement_m, width_m);
  if (pavement_share > 0) {
    const Tiling slab = TileAt(place.uv, {0.6F, 0.6F}, 0.04F, place, ground.seed + 13);
    const Vector3f slabs = Modulated({0.3F, 0.29F, 0.28F}, 0.2F * slab.shade - 0.4F * slab.joint);
    colour = Mix(colour, Gravel(slabs, place, ground.seed + 14), pavement_share);
  }
  const float street_share = 1 - Step(street_m - kStreetHalfWidth_m, width_m);
  return street_share > 0 ? Mix(colour, Asphalt(place, ground.seed + 40), street_share) : colour;
}

Vector3f Unbounded(const Surface& surface, const GroundMap* ground, const Place& place) {
  switch (surface.material) {
    case Material::kTestPattern:
      return TestPattern(surface, place);
    case Material::kGround:
      return Ground(*ground, place);
    case Material::kPlaster:
      return Plaster(surface, place);
    case Material::kStone:
      return Stone(surface, place);
    case Material::kRoofTiles:
      return RoofTiles(surface, place);
    case Material::kGravel:
      return Gravel(surface.colour, place, surface.seed);
    case Material::kGlass:
    case Material::kMirrorGlass:
      return Glass(surface, place);
    case Material::kWood:
      return Wood(surface, place);
    case Material::kPaint:
    case Material::kWater:
      return surface.colour;
    case Material::kBareWall:
      return BareWall(surface, place);
    case Material::kAsphalt:
      return Asphalt(place, surface.seed);
    case Material::kFoliage:
      return Foliage(surface, place);
    case Material::kSoil:
      return Soil(surface, place);
  }
  return surface.colour;
}

}  // namespace

float Reflectance(Material material, float cosine) {
  // At a right angle: water 2 %; panes have two faces, and often a coating.
  const float facing =
      material == Material::kWater ? 0.02F : (material == Material::kMirrorGlass ? 0.14F : 0.0F);
  if (facing == 0) return 0;
  const float t = std::clamp(1 - cosine, 0.0F, 1.0F);
  return facing + (1 - facing) * t * t * t * t * t;  // Schlick 1994
}

Eigen::Vector2f RippleSlope(const Surface& surface, const Eigen::Vector2f& p_m, float footprint_m) {
  const FractalOptions ripples{2.5F, 0.15F, 0.6F, surface.seed};
  return 0.05F * Vector2f(FractalNoise(p_m, ripples, footprint_m),
                          FractalNoise(Vector2f(p_m + Vector2f(91, 37)), ripples, footprint_m));
}

Eigen::Vector3f Albedo(const Surface& surface, const GroundMap* ground,
                       const Eigen::Vector3f& p_world, float footprint_m) {
  const Vector3f offset = p_world - surface.origin;
  const Place place{p_world, {surface.u_axis.dot(offset), surface.v_axis.dot(offset)}, footprint_m};
  return Unbounded(surface, ground, place).cwiseMin(1);
}

}  // namespace mono3d::synthetic
