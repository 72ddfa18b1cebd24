// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/town.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "synthetic/building.h"
#include "synthetic/car.h"
#include "synthetic/house.h"
#include "synthetic/planting.h"

namespace mono3d::synthetic {

namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kBlockLength_m = 72;
constexpr float kBlockWidth_m = 50;
constexpr float kFromStreet_m = 6.2F;  // of a facade, from the middle of the street
constexpr float kHouseLength_m = 6.4F;
constexpr float kHouseDepth_m = 9;

// A block between streets: its middle, and the directions of its sides.
struct TownBlock {
  Vector2f middle;
  Vector2f along;
  Vector2f across;

  Vector2f At(float u_m, float v_m) const { return middle + u_m * along + v_m * across; }
};

// What the houses of one row have in common.
struct Row {
  HouseOptions house;
  std::uint32_t seed;
};

Row RandomRow(Site& site) {
  Row row{RandomHouse(site.random), site.random.Bits()};
  row.house.length_m = kHouseLength_m;
  row.house.width_m = kHouseDepth_m;
  row.house.num_storeys = site.random.Chance(0.7) ? 2 : 3;
  row.house.roof_slope = 0.75F;
  row.house.gable_overhang_m = 0;
  row.house.has_gable_windows = false;
  row.house.window_share = 1;
  row.house.shutter_share = 0;
  row.house.panel_share = 0.35;
  return row;
}

// Houses on one long side of the block; `side` is -1 or 1 across it.
void AddRow(Site& site, const TownBlock& block, float side) {
  const Row row = RandomRow(site);
  const int num_houses =
      static_cast<int>((kBlockLength_m - 2 * kFromStreet_m - 3) / kHouseLength_m);
  const float v_m = side * (kBlockWidth_m / 2 - kFromStreet_m - kHouseDepth_m / 2);
  const Vector2f outwards = side * block.across;
  for (int i = 0; i < num_houses; ++i) {
    const float u_m =
        (static_cast<float>(i) - static_cast<float>(num_houses - 1) / 2) * kHouseLength_m;
    const Vector2f middle = block.At(u_m, v_m);
    const Plot plot{middle, kHouseDepth_m / 2};
    if (IsAtWater(site.ground, middle, 9)) continue;
    site.plots.push_back(plot);
    HouseOptions house = row.house;
    house.base = site.At(middle) + 0.3F * Vector3f::UnitZ();
    // The door is on the side of -y.
    house.yaw_rad = std::atan2(outwards.y(), outwards.x()) + 1.5707963F;
    RandomNumbers alike(row.seed);
    AddHouse(site.mesh, house, alike);
  }
}

void AddRows(Site& site, const TownBlock& block) {
  AddRow(site, block, -1);
  AddRow(site, block, 1);
  const float half_m = kBlockLength_m / 2 - kFromStreet_m - 4;
  AddHedge(site, block.At(-half_m, 0), block.At(half_m, 0));
  for (float u_m = -half_m; u_m <= half_m; u_m += 2 * kHouseLength_m) {
    AddHedge(site, block.At(u_m, -8), block.At(u_m, 8));
    const Vector2f place = block.At(u_m + site.Random(2, 8), site.Random(-7, 7));
    if (site.random.Chance(0.5) && site.IsFree({place, 1})) AddTree(site, place, 0.2);
  }
}

void AddFlats(Site& site, const TownBlock& block) {
  const Finish wall{Material::kPlaster, Vector3f(0.5F, 0.48F, 0.44F), site.random.Bits()};
  const Finish roof{Material::kGravel, Vector3f::Constant(0.27F), site.random.Bits()};
  for (const float v_m : {-11.0F, 11.0F}) {
    BuildingOptions flats;
    flats.base = site.At(block.At(0, v_m)) + 0.3F * Vector3f::UnitZ();
    flats.yaw_rad = std::atan2(block.along.y(), block.along.x());
    flats.length_m = site.Random(30, 48);
    flats.width_m = 11;
    flats.num_storeys = 3 + static_cast<int>(site.random.Uniform(0, 3.99));
    flats.wall = wall;
    flats.roof = roof;
    if (!site.IsFree({block.At(0, v_m), 12})) continue;
    for (const float u_m : {-16.0F, -6.0F, 6.0F, 16.0F}) {
      site.plots.push_back({block.At(u_m, v_m), 8});
    }
    AddBuilding(site.mesh, flats, site.random);
  }
}

void AddSquare(Site& site, const TownBlock& block) {
  for (int i = 0; i < 22; ++i) {
    const Vector2f place = block.At(site.Random(-27, 27), site.Random(-16, 16));
    if (!site.IsFree({place, 2})) continue;
    AddTree(site, place, 0.1);
  }
  site.plots.push_back({block.middle, 18});
}

void AddCarPark(Site& site, const TownBlock& block) {
  constexpr float kHalfLength_m = 26;
  constexpr float kHalfWidth_m = 15;
  if (!site.IsFree({block.middle, 20})) return;
  site.plots.push_back({block.middle, 20});
  const Vector3f along = Horizontal(block.along);
  const Vector3f across = Horizontal(block.across);
  // As high as the ground below it is anywhere.
  Vector3f ground = site.At(block.middle);
  for (float u_m = -kHalfLength_m; u_m <= kHalfLength_m; u_m += 2) {
    for (float v_m = -kHalfWidth_m; v_m <= kHalfWidth_m; v_m += 2) {
      ground.z() = std::max(ground.z(), site.At(block.At(u_m, v_m)).z() + 0.08F);
    }
  }
  AddBlock(site.mesh,
           CentredBlock(ground - 2 * Vector3f::UnitZ(), 2 * kHalfLength_m * along,
                        2 * kHalfWidth_m * across, 4 * Vector3f::UnitZ()),
           {Material::kAsphalt, Vector3f::Constant(0.12F), site.random.Bits()});
  for (const float v_m : {-11.0F, -3.5F, 3.5F, 11.0F}) {
    for (float u_m = 3 - kHalfLength_m; u_m < kHalfLength_m - 2; u_m += 2.6F) {
      if (!site.random.Chance(0.6)) continue;
      AddCar(site.mesh, {ground + u_m * along + v_m * across, across}, site.random);
    }
  }
}

}  // namespace

TownPlan LayTown(Site& site) {
  TownPlan plan{site.Random(-0.35, 0.35)};
  const auto reach_m = static_cast<float>(site.terrain.half_extent_m);
  const Vector2f along(std::cos(plan.yaw_rad), std::sin(plan.yaw_rad));
  const Vector2f across = Left(along);
  std::vector<Polyline> streets;
  const auto num_across = static_cast<int>(reach_m / kBlockWidth_m);
  const auto num_along = static_cast<int>(reach_m / kBlockLength_m);
  for (int i = -num_across; i <= num_across + 1; ++i) {
    const float v_m = (static_cast<float>(i) - 0.5F) * kBlockWidth_m;
    streets.push_back(Winding({v_m * across, plan.yaw_rad, 1.1F * reach_m, 0}));
  }
  site.routes = streets;
  for (int i = -num_along; i <= num_along + 1; ++i) {
    const float u_m = (static_cast<float>(i) - 0.5F) * kBlockLength_m;
    streets.push_back(Winding({u_m * along, plan.yaw_rad + 1.5707963F, 1.1F * reach_m, 0}));
  }
  LayStreets(site, std::move(streets));
  site.terrain.bumps_m = 0.2;  // gardens and lawns
  return plan;
}

void AddTown(Site& site, const TownPlan& plan) {
  LayTerrain(site);
  const auto reach_m = static_cast<float>(site.terrain.half_extent_m);
  const Vector2f along(std::cos(plan.yaw_rad), std::sin(plan.yaw_rad));
  const Vector2f across = Left(along);
  const auto num_across = static_cast<int>(reach_m / kBlockWidth_m);
  const auto num_along = static_cast<int>(reach_m / kBlockLength_m);
  for (int j = -num_across; j <= num_across; ++j) {
    for (int i = -num_along; i <= num_along; ++i) {
      const TownBlock block{static_cast<float>(i) * kBlockLength_m * along +
                                static_cast<float>(j) * kBlockWidth_m * across,
                            along, across};
      const double kind = site.random.Uniform(0, 1);
      if (block.middle.cwiseAbs().maxCoeff() > reach_m - 20) continue;
      if (kind < 0.62) {
        AddRows(site, block);
      } else if (kind < 0.8) {
        AddFlats(site, block);
      } else if (kind < 0.9) {
        AddSquare(site, block);
      } else {
        AddCarPark(site, block);
      }
    }
  }
  AddParkedCars(site, 0.35);
}

}  // namespace mono3d::synthetic
