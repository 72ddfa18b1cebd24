// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/planting.h"

#include <algorithm>

#include "synthetic/vegetation.h"

namespace mono3d::synthetic {

using Eigen::Vector2f;
using Eigen::Vector3f;

void AddTree(Site& site, const Vector2f& place, double conifer_share) {
  const PlantOptions tree{site.At(place), site.Random(4.5, 10)};
  if (site.random.Chance(conifer_share)) {
    AddConifer(site.mesh, tree, site.random);
  } else {
    AddBroadleafTree(site.mesh, tree, site.random);
  }
}

void AddPlants(Site& site, const PlantingOptions& options) {
  const auto reach_m = 0.95F * static_cast<float>(site.terrain.half_extent_m);
  for (int i = 0; i < options.num_trees; ++i) {
    const auto place = OpenPlace(site, 1.5F, i % 3 == 0 ? reach_m : options.tree_reach_m);
    if (place) AddTree(site, *place, options.conifer_share);
  }
  for (int i = 0; i < options.num_bushes; ++i) {
    const auto place = OpenPlace(site, 0.5F, options.bush_reach_m);
    if (place) AddBush(site.mesh, {site.At(*place), site.Random(0.8, 2)}, site.random);
  }
}

void AddHedge(Site& site, const Vector2f& from, const Vector2f& to) {
  const Vector2f step = to - from;
  const int num_pieces = std::max(1, static_cast<int>(step.norm() / 1.5F));
  const Finish leaves{Material::kFoliage, Vector3f(0.06F, 0.12F, 0.035F), site.random.Bits()};
  for (int i = 0; i < num_pieces; ++i) {
    const float t = (static_cast<float>(i) + 0.5F) / static_cast<float>(num_pieces);
    const Vector2f middle = from + t * step;
    if (site.ground.streets.At(middle) < kStreetHalfWidth_m + kPavementWidth_m) continue;
    if (IsAtWater(site.ground, middle, 2)) continue;
    const Vector3f along = Horizontal(step.normalized());
    const float length_m = 1.05F * step.norm() / static_cast<float>(num_pieces);
    const float height_m = 1.5F + site.Random(-0.2, 0.2);
    const Vector3f thickness = site.Random(0.7, 0.95) * Horizontal(Left(step));
    AddBlock(site.mesh,
             CentredBlock(site.At(middle) + 0.2F * Vector3f::UnitZ(), length_m * along, thickness,
                          2 * height_m * Vector3f::UnitZ()),
             leaves);
  }
}

}  // namespace mono3d::synthetic
