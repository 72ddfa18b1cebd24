// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/water.h"

#include <algorithm>
#include <cmath>

namespace mono3d::synthetic {

namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kBelowGround_m = 1.5F;
constexpr float kEndOfTerrain_m = 3000;  // where the terrain ends
constexpr float kMargin_m = 2;           // of the surface, under the banks
constexpr float kBridgeReach_m = 6;      // a bridge ends this far from the shore
constexpr float kDeck_m = 1;             // above the water

const Finish kConcrete{Material::kGravel, Vector3f(0.33F, 0.32F, 0.3F), 21};

void AddWaterSurface(Site& site, const WaterOptions& options) {
  const Polyline& line = options.middle;
  const float half_width_m = options.half_width_m + kMargin_m;
  const int num_pieces = static_cast<int>(line.size()) - 1;
  const auto position = [&](float s, float t) {
    const auto i = static_cast<std::size_t>(std::lround(s * static_cast<float>(num_pieces)));
    const Vector2f along = line[std::min(i + 1, line.size() - 1)] - line[i > 0 ? i - 1 : 0];
    // A pond ends half its width beyond the ends of its middle line.
    const float beyond_m = i == 0 ? -half_width_m : (i + 1 == line.size() ? half_width_m : 0);
    const Vector2f p =
        line[i] + (2 * t - 1) * half_width_m * Left(along) + beyond_m * along.normalized();
    return Vector3f(p.x(), p.y(), site.ground.water_level_m);
  };
  AddSheet(site.mesh, {num_pieces, 1}, position,
           {Material::kWater, Vector3f(0.03F, 0.045F, 0.03F), site.ground.seed});
}

// A straight deck with parapets between two places.
void AddBridge(Site& site, const Vector2f& from, const Vector2f& to) {
  constexpr float kThickness_m = 0.7F;
  constexpr float kBridgeParapet_m = 0.9F;
  const float width_m = 2 * (kStreetHalfWidth_m + 0.6F);
  const Vector3f along = Horizontal(to - from);
  const Vector3f across = Horizontal(Left(to - from));
  const Vector3f up = Vector3f::UnitZ();
  Vector3f middle = Horizontal((from + to) / 2);
  middle.z() = site.ground.water_level_m + kDeck_m - kThickness_m / 2;
  AddBlock(site.mesh, CentredBlock(middle, along, width_m * across, kThickness_m * up),
           {Material::kAsphalt, Vector3f::Constant(0.13F), site.random.Bits()});
  for (const float side : {-0.5F, 0.5F}) {
    const Vector3f base = middle + side * (width_m + 0.3F) * across + 0.3F * up;
    AddBlock(site.mesh,
             CentredBlock(base, along, 0.3F * across, (kThickness_m + kBridgeParapet_m) * up),
             kConcrete);
  }
}

}  // namespace

void LayWater(Site& site, const WaterOptions& options) {
  const Terrain terrain(site.terrain, site.ground);
  const auto extent_m = static_cast<float>(site.terrain.half_extent_m);
  float sum_m = 0;
  int num_places = 0;
  for (const Vector2f& p : options.middle) {
    if (p.cwiseAbs().maxCoeff() > extent_m) continue;
    sum_m += terrain.HeightAt(p);
    ++num_places;
  }
  site.ground.water_level_m = sum_m / static_cast<float>(std::max(num_places, 1)) - kBelowGround_m;
  site.ground.water_half_width_m = options.half_width_m;
  site.ground.water = DistanceField(std::vector<Polyline>{options.middle}, extent_m);
}

WaterOptions River(const Site& site, float y_m) {
  const auto extent_m = static_cast<float>(site.terrain.half_extent_m);
  WaterOptions river;
  river.half_width_m = 6.5F;
  river.middle.emplace_back(-kEndOfTerrain_m, y_m);
  constexpr float kStep_m = 6;
  for (float x = -extent_m; x <= extent_m; x += kStep_m) {
    // It runs straight where it leaves the site.
    const float swing_m = 10 * (1 - std::pow(std::abs(x) / extent_m, 4.0F));
    river.middle.emplace_back(x, y_m + swing_m * std::sin(x / 41));
  }
  river.middle.emplace_back(kEndOfTerrain_m, y_m);
  return river;
}

WaterOptions Pond(const Vector2f& middle) {
  WaterOptions pond;
  pond.half_width_m = 9;
  pond.middle = {middle - Vector2f(7, 2), middle, middle + Vector2f(7, -2)};
  return pond;
}

void AddWater(Site& site, const WaterOptions& options) {
  AddWaterSurface(site, options);
  const float reach_m = options.half_width_m + kBridgeReach_m;
  for (const Polyline& street : site.streets) {
    const Vector2f* from = nullptr;
    for (const Vector2f& p : street) {
      const bool is_over = site.ground.water.At(p) < reach_m;
      if (is_over && from == nullptr) from = &p;
      if (!is_over && from != nullptr) {
        AddBridge(site, *from, p);
        from = nullptr;
      }
    }
  }
}

}  // namespace mono3d::synthetic
