// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/country.h"

#include <cmath>

#include "synthetic/car.h"
#include "synthetic/planting.h"

namespace mono3d::synthetic {

namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

// Trees around a place.
void AddWood(Site& site, const Vector2f& middle, float radius_m, int num_trees) {
  for (int i = 0; i < num_trees; ++i) {
    const float distance_m = radius_m * std::sqrt(site.Random(0, 1));
    const float azimuth_rad = site.Random(0, 6.2831853);
    const Vector2f place =
        middle + distance_m * Vector2f(std::cos(azimuth_rad), std::sin(azimuth_rad));
    if (place.cwiseAbs().maxCoeff() > static_cast<float>(site.terrain.half_extent_m)) continue;
    if (site.IsFree({place, 1.5F})) AddTree(site, place, 0.6);
  }
}

}  // namespace

std::vector<PlacedHouse> LayFields(Site& site) {
  const auto reach_m = static_cast<float>(site.terrain.half_extent_m);
  site.terrain.bumps_m = 0.12;
  LayStreets(site, {Winding({{0, 25}, 0.12F, 1.05F * reach_m, 3})});
  site.routes = site.streets;
  std::vector<PlacedHouse> houses = PlaceHouses(site, 0.8F * reach_m, 0.07);
  std::vector<Polyline> paths = Drives(houses);
  paths.push_back({{-20, 25}, {-32, -40}, {-20, -reach_m}});
  LayPaths(site, paths);
  return houses;
}

void AddFields(Site& site, const std::vector<PlacedHouse>& houses) {
  LayTerrain(site);
  AddHouses(site, houses);
  AddParkedCars(site, 0.03);
  const auto reach_m = static_cast<float>(site.terrain.half_extent_m);
  // An avenue along part of the path.
  for (float y = -30; y > -0.7F * reach_m; y -= 11) {
    const Vector2f place(site.Random(-24, -22), y);
    if (site.random.Chance(0.7) && site.IsFree({place, 1})) AddTree(site, place, 0);
  }
  PlantingOptions plants;
  plants.num_trees = 26;
  plants.num_bushes = 25;
  plants.tree_reach_m = 0.9F * reach_m;
  plants.bush_reach_m = 0.9F * reach_m;
  AddPlants(site, plants);
}

std::vector<PlacedHouse> LayHills(Site& site) {
  const auto reach_m = static_cast<float>(site.terrain.half_extent_m);
  LayStreets(site, {Winding({{0, 12}, 0.4F, reach_m, 16})});
  site.routes = site.streets;
  std::vector<PlacedHouse> houses = PlaceHouses(site, 110, 0.25);
  std::vector<Polyline> paths = Drives(houses);
  paths.push_back(Winding({{0, -40}, 1.2F, 0.9F * reach_m, 14}));
  paths.push_back(Winding({{30, 40}, -0.4F, 0.9F * reach_m, 12}));
  LayPaths(site, paths);
  return houses;
}

void AddHills(Site& site, const std::vector<PlacedHouse>& houses) {
  LayTerrain(site);
  AddHouses(site, houses);
  AddParkedCars(site, 0.05);
  const auto reach_m = static_cast<float>(site.terrain.half_extent_m);
  for (int i = 0; i < 6; ++i) {
    const float x = site.Random(-0.7, 0.7) * reach_m;
    AddWood(site, {x, site.Random(-0.7, 0.7) * reach_m}, site.Random(18, 34), 32);
  }
  PlantingOptions plants;
  plants.num_trees = 70;
  plants.num_bushes = 120;
  plants.tree_reach_m = 0.6F * reach_m;
  plants.bush_reach_m = 0.6F * reach_m;
  AddPlants(site, plants);
}

}  // namespace mono3d::synthetic
