// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/landmark.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "synthetic/building.h"
#include "synthetic/car.h"
#include "synthetic/facade.h"
#include "synthetic/planting.h"

namespace mono3d::synthetic {

namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kQuarterTurn_rad = 1.5707963F;
constexpr float kKeepFree_m = 44;
const Vector3f kUp = Vector3f::UnitZ();

HouseOptions Wing(const Vector3f& base, float yaw_rad, const Finish& wall, const Finish& roof) {
  HouseOptions wing;
  wing.base = base;
  wing.yaw_rad = yaw_rad;
  wing.num_storeys = 3;
  wing.roof_slope = 0.7F;
  wing.window_share = 1;
  wing.panel_share = 0;
  wing.wall = wall;
  wing.roof = roof;
  return wing;
}

void AddMansion(Site& site, const Vector3f& base) {
  const Finish wall{Material::kPlaster, Vector3f(0.56F, 0.49F, 0.34F), site.random.Bits()};
  const Finish roof{Material::kRoofTiles, Vector3f(0.2F, 0.2F, 0.22F), site.random.Bits()};
  const Finish stone{Material::kStone, Vector3f(0.55F, 0.52F, 0.46F), site.random.Bits()};
  HouseOptions main = Wing(base, 0, wall, roof);
  main.length_m = 38;
  main.width_m = 14;
  AddHouse(site.mesh, main, site.random);
  for (const float side : {-1.0F, 1.0F}) {
    HouseOptions wing = Wing(base + Vector3f(side * 15, -9, -0.02F), kQuarterTurn_rad, wall, roof);
    wing.length_m = 26;
    wing.width_m = 10.5F;
    AddHouse(site.mesh, wing, site.random);
  }
  // A portico: columns under a slab with a gable.
  for (int i = 0; i < 6; ++i) {
    const float x = (static_cast<float>(i) - 2.5F) * 2.1F;
    AddBlock(site.mesh,
             CentredBlock(base + Vector3f(x, -11, 2.9F), 0.6F * Vector3f::UnitX(),
                          0.6F * Vector3f::UnitY(), 6.2F * kUp),
             stone);
  }
  AddBlock(site.mesh,
           CentredBlock(base + Vector3f(0, -9.3F, 6.2F), 12.5F * Vector3f::UnitX(),
                        4.7F * Vector3f::UnitY(), 0.6F * kUp),
           stone);
  AddBlock(site.mesh,
           CentredBlock(base + Vector3f(0, -9.3F, -0.4F), 13 * Vector3f::UnitX(),
                        5 * Vector3f::UnitY(), 1.2F * kUp),
           stone);
  for (const float y : {-38.0F, -30.0F}) {
    for (const float side : {-1.0F, 1.0F}) {
      AddHedge(site, Vector2f(side * 5, y), Vector2f(side * 26, y));
      AddHedge(site, Vector2f(side * 5, y), Vector2f(side * 5, y + 7));
    }
  }
}

void AddTower(Site& site, const Vector3f& base, const Finish& wall) {
  constexpr float kSide_m = 8;
  constexpr float kHeight_m = 27;
  constexpr float kSpire_m = 17;
  const Vector3f x = Vector3f::UnitX();
  const Vector3f y = Vector3f::UnitY();
  AddBlock(
      site.mesh,
      {base - kSide_m / 2 * (x + y) - 3 * kUp, kSide_m * x, kSide_m * y, (kHeight_m + 3) * kUp},
      wall);
  const Finish slate{Material::kRoofTiles, Vector3f(0.12F, 0.13F, 0.15F), site.random.Bits()};
  const Vector3f top = base + (kHeight_m + kSpire_m) * kUp;
  const float reach_m = kSide_m / 2 + 0.4F;
  const Vector3f eave = base + kHeight_m * kUp;
  const std::array<Vector3f, 4> corners = {eave - reach_m * (x + y), eave + reach_m * (x - y),
                                           eave + reach_m * (x + y), eave - reach_m * (x - y)};
  for (std::size_t i = 0; i < 4; ++i) {
    AddTriangle(site.mesh, {corners[i], corners[(i + 1) % 4], top}, slate);
  }
  AddParallelogram(site.mesh, {corners[0], corners[3] - corners[0], corners[1] - corners[0]},
                   slate);
  const Finish dial{Material::kPaint, Vector3f(0.6F, 0.58F, 0.5F), 0};
  const Finish shade{Material::kPaint, Vector3f::Constant(0.05F), 0};
  const std::array<Wall, 4> walls = {{{base - kSide_m / 2 * (x + y), x, -y, kSide_m},
                                      {base + kSide_m / 2 * (x - y), y, x, kSide_m},
                                      {base + kSide_m / 2 * (x + y), -x, y, kSide_m},
                                      {base - kSide_m / 2 * (x - y), -y, -x, kSide_m}}};
  for (const Wall& side : walls) {
    AddSlab(site.mesh, side, {kSide_m / 2, 19, 2.4F, 2.4F}, 0.15F, dial);
    for (const float along_m : {2.7F, 5.3F}) {
      AddSlab(site.mesh, side, {along_m, 23.5F, 1.3F, 3.6F}, 0.06F, shade);
    }
  }
}

void AddChurch(Site& site, const Vector3f& base) {
  const Finish wall{Material::kStone, Vector3f(0.46F, 0.42F, 0.36F), site.random.Bits()};
  const Finish roof{Material::kRoofTiles, Vector3f(0.3F, 0.14F, 0.09F), site.random.Bits()};
  HouseOptions nave = Wing(base + Vector3f(4, 0, 0), 0, wall, roof);
  nave.length_m = 30;
  nave.width_m = 13;
  nave.num_storeys = 4;
  nave.roof_slope = 1.15F;
  nave.window_share = 0;
  nave.shutter_share = 0;
  AddHouse(site.mesh, nave, site.random);
  HouseOptions transept = Wing(base + Vector3f(9, 0, -0.02F), kQuarterTurn_rad, wall, roof);
  transept.length_m = 24;
  transept.width_m = 9;
  transept.roof_slope = 1.15F;
  transept.window_share = 0.9;
  transept.shutter_share = 0;
  AddHouse(site.mesh, transept, site.random);
  AddTower(site, base - Vector3f(15, 0, 0), wall);
  for (const float side : {-1.0F, 1.0F}) {
    const Wall flank =
        side < 0 ? Wall{base + Vector3f(-11, -6.5F, 0), Vector3f::UnitX(), -Vector3f::UnitY(), 30}
                 : Wall{base + Vector3f(19, 6.5F, 0), -Vector3f::UnitX(), Vector3f::UnitY(), 30};
    for (int i = 0; i < 7; ++i) {
      const float along_m = 2.2F + 4.2F * static_cast<float>(i);
      AddWindow(site.mesh, flank, {along_m, 6, 1.3F, 5}, site.random);
      AddSlab(site.mesh, flank, {along_m + 2.1F, 4.2F, 0.8F, 8.4F}, 1.1F, wall);
    }
  }
  // The churchyard: rows of stones.
  for (float x = -30; x < 32; x += 3) {
    for (const float y : {-24.0F, -20.0F, 20.0F, 24.0F}) {
      if (!site.random.Chance(0.75)) continue;
      const Vector2f place(x + site.Random(-0.3, 0.3), y);
      AddBlock(site.mesh,
               CentredBlock(site.At(place) + 0.3F * kUp, 0.25F * Vector3f::UnitX(),
                            0.8F * Vector3f::UnitY(), site.Random(1.2, 2) * kUp),
               {Material::kStone, Vector3f::Constant(site.Random(0.2, 0.5)), site.random.Bits()});
    }
  }
}

void AddContainers(Site& site, const Vector3f& ground) {
  for (int i = 0; i < 14; ++i) {
    const Vector3f place(-30 + 4.4F * static_cast<float>(i), -30.5F, 0);
    if (!site.random.Chance(0.7)) continue;
    const Vector3f colour(site.Random(0.08, 0.45), site.Random(0.08, 0.35), site.Random(0.06, 0.4));
    const int num_stacked = site.random.Chance(0.3) ? 2 : 1;
    for (int level = 0; level < num_stacked; ++level) {
      AddBlock(site.mesh,
               CentredBlock(ground + place + (1.3F + 2.6F * static_cast<float>(level)) * kUp,
                            2.44F * Vector3f::UnitX(), 6.1F * Vector3f::UnitY(), 2.58F * kUp),
               {Material::kWood, colour, site.random.Bits()});
    }
  }
}

void AddWarehouse(Site& site, const Vector3f& base) {
  const Vector3f ground = base + 0.25F * kUp;
  AddBlock(site.mesh,
           CentredBlock(ground - 2 * kUp, 96 * Vector3f::UnitX(), 76 * Vector3f::UnitY(), 4 * kUp),
           {Material::kAsphalt, Vector3f::Constant(0.13F), site.random.Bits()});
  BuildingOptions hall;
  hall.base = ground + Vector3f(0, 6, 0);
  hall.length_m = 64;
  hall.width_m = 38;
  hall.num_storeys = 4;
  hall.has_windows = false;
  hall.wall = {Material::kBareWall, Vector3f(0.33F, 0.34F, 0.34F), site.random.Bits()};
  hall.roof = {Material::kBareWall, Vector3f(0.19F, 0.19F, 0.2F), site.random.Bits()};
  AddBuilding(site.mesh, hall, site.random);
  const Wall front{hall.base + Vector3f(-32, -19, 0), Vector3f::UnitX(), -Vector3f::UnitY(), 64};
  const Finish gate{Material::kPaint, Vector3f(0.12F, 0.2F, 0.32F), 0};
  for (int i = 0; i < 6; ++i) {
    AddSlab(site.mesh, front, {7 + 10 * static_cast<float>(i), 2.2F, 4.2F, 4.4F}, 0.12F, gate);
  }
  // Skylights.
  const Finish glass{Material::kGlass, Vector3f(0.09F, 0.11F, 0.13F), site.random.Bits()};
  for (int i = 0; i < 7; ++i) {
    AddBlock(site.mesh,
             CentredBlock(hall.base + Vector3f(-27 + 9 * static_cast<float>(i), 0, 11.3F),
                          1.6F * Vector3f::UnitX(), 26 * Vector3f::UnitY(), 0.5F * kUp),
             glass);
  }
  AddContainers(site, ground);
  for (float x = -40; x < 40; x += 2.8F) {
    if (!site.random.Chance(0.45)) continue;
    AddCar(site.mesh, {ground + Vector3f(x, -22.5F, 0), Vector3f::UnitY()}, site.random);
  }
}

}  // namespace

std::vector<PlacedHouse> LayLandmark(Site& site, Landmark landmark) {
  const auto reach_m = static_cast<float>(site.terrain.half_extent_m);
  site.terrain.flat_radius_m = kKeepFree_m + 16;
  site.ground.lawn_radius_m = 95;
  LayStreets(site,
             {Winding({{0, -88}, 0, reach_m, 5}), Winding({{92, 0}, 1.5707963F, reach_m, 6})});
  site.routes = site.streets;
  site.plots.push_back({Vector2f::Zero(), kKeepFree_m});
  constexpr float kHousesReach_m = 175;
  std::vector<PlacedHouse> houses = PlaceHouses(site, kHousesReach_m, 0.4);
  std::vector<Polyline> paths = Drives(houses);
  if (landmark != Landmark::kWarehouse) {
    paths.push_back({{0, -88}, {0, -24}, {-34, -24}, {-34, 24}, {34, 24}, {34, -24}, {0, -24}});
  } else {
    paths.push_back({{0, -88}, {0, -30}});
  }
  LayPaths(site, paths);
  return houses;
}

void AddLandmark(Site& site, Landmark landmark, const std::vector<PlacedHouse>& houses) {
  LayTerrain(site);
  const Vector3f base = site.At(Vector2f::Zero()) + 0.3F * kUp;
  if (landmark == Landmark::kMansion) AddMansion(site, base);
  if (landmark == Landmark::kChurch) AddChurch(site, base);
  if (landmark == Landmark::kWarehouse) AddWarehouse(site, base);
  AddHouses(site, houses);
  AddParkedCars(site, 0.2);
  PlantingOptions plants;
  plants.num_trees = 150;
  plants.num_bushes = 120;
  plants.tree_reach_m = 85;
  plants.bush_reach_m = 85;
  AddPlants(site, plants);
}

}  // namespace mono3d::synthetic
