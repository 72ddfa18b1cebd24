// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/site.h"

#include <cmath>
#include <utility>

namespace mono3d::synthetic {

using Eigen::Vector2f;
using Eigen::Vector3f;

Vector3f Site::At(const Vector2f& p_m) const { return Terrain(terrain, ground).At(p_m); }

bool Site::IsFree(const Plot& plot) const {
  for (const Plot& other : plots) {
    if ((other.middle - plot.middle).norm() < other.radius_m + plot.radius_m) return false;
  }
  if (IsAtWater(ground, plot.middle, 2 + plot.radius_m)) return false;
  return ground.streets.At(plot.middle) > kStreetHalfWidth_m + 0.6F * plot.radius_m;
}

Polyline Winding(const WindingLine& line) {
  const Vector2f along(std::cos(line.direction_rad), std::sin(line.direction_rad));
  const Vector2f aside(-along.y(), along.x());
  Polyline places;
  constexpr float kStep_m = 6;
  for (float s = -line.half_length_m; s <= line.half_length_m; s += kStep_m) {
    places.push_back(line.through + s * along + line.swing_m * std::sin(s / 38) * aside);
  }
  return places;
}

void LayStreets(Site& site, std::vector<Polyline> streets) {
  site.streets = std::move(streets);
  site.ground.streets = DistanceField(site.streets, site.terrain.half_extent_m);
}

void LayPaths(Site& site, const std::vector<Polyline>& paths) {
  constexpr float kReach_m = 12;  // as far as anything asks
  site.ground.paths = DistanceField(paths, site.terrain.half_extent_m, kReach_m);
}

void LayTerrain(Site& site) {
  const Terrain terrain(site.terrain, site.ground);
  terrain.AddTo(site.mesh);
  constexpr float kCell_m = 2;
  site.ground.heights = Grid(site.terrain.half_extent_m, kCell_m,
                             [&](const Vector2f& p_m) { return terrain.HeightAt(p_m); });
}

std::optional<Vector2f> OpenPlace(Site& site, float room_m, float reach_m) {
  for (int attempt = 0; attempt < 20; ++attempt) {
    const float x = site.Random(-reach_m, reach_m);
    const Vector2f place(x, site.Random(-reach_m, reach_m));
    if (!site.IsFree({place, room_m})) continue;
    if (site.ground.paths.At(place) > kPathHalfWidth_m + 0.5F) return place;
  }
  return std::nullopt;
}

}  // namespace mono3d::synthetic
