// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/village.h"

#include <Eigen/Geometry>
#include <cmath>
#include <utility>
#include <vector>

#include "synthetic/house.h"
#include "synthetic/noise.h"
#include "synthetic/terrain.h"
#include "synthetic/vegetation.h"

namespace mono3d::synthetic {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

// Where something stands, and how much room it takes.
struct Plot {
  Vector2f middle;
  float radius_m;
};

// What the parts of the village share while it is built.
struct Site {
  const VillageOptions& options;
  GroundMap ground;
  std::vector<Polyline> streets;
  std::vector<Plot> houses;
  Mesh mesh;
  RandomNumbers random;
};

float Random(Site& site, double low, double high) {
  return static_cast<float>(site.random.Uniform(low, high));
}

// A winding line through `through` in the given direction.
Polyline WindingStreet(const Vector2f& through, float direction_rad, float half_length_m,
                       float swing_m) {
  const Vector2f along(std::cos(direction_rad), std::sin(direction_rad));
  const Vector2f aside(-along.y(), along.x());
  Polyline line;
  constexpr float kStep_m = 6;
  for (float s = -half_length_m; s <= half_length_m; s += kStep_m) {
    line.push_back(through + s * along + swing_m * std::sin(s / 38) * aside);
  }
  return line;
}

bool IsFree(const Site& site, const Plot& plot) {
  for (const Plot& other : site.houses) {
    if ((other.middle - plot.middle).norm() < other.radius_m + plot.radius_m) return false;
  }
  return site.ground.streets.At(plot.middle) > kStreetHalfWidth_m + 0.6F * plot.radius_m;
}

struct PlacedHouse {
  HouseOptions house;
  Vector2f middle;
  Vector2f at_street;
};

// Both sides of each street, wherever there is room.
std::vector<PlacedHouse> PlaceHouses(Site& site) {
  std::vector<PlacedHouse> placed;
  for (const Polyline& street : site.streets) {
    for (std::size_t i = 1; i + 1 < street.size(); ++i) {
      const Vector2f along = (street[i + 1] - street[i - 1]).normalized();
      for (const float side : {-1.0F, 1.0F}) {
        const Vector2f aside = side * Vector2f(-along.y(), along.x());
        const Vector2f middle = street[i] + Random(site, 11.5, 15) * aside;
        if (middle.norm() > 120 || !IsFree(site, {middle, 8.2F})) continue;
        PlacedHouse house{RandomHouse(site.random), middle, street[i]};
        const float turn = site.random.Chance(0.3) ? 1.5707963F : 0;
        house.house.yaw_rad = std::atan2(along.y(), along.x()) + turn + Random(site, -0.08, 0.08);
        if (side < 0) house.house.yaw_rad += 3.1415927F;
        site.houses.push_back({middle, 8.2F});
        placed.push_back(house);
      }
    }
  }
  return placed;
}

// A hedge between two places, in pieces that follow the ground.
void AddHedge(Site& site, const Terrain& terrain, const Vector2f& from, const Vector2f& to) {
  const Vector2f step = to - from;
  const int num_pieces = std::max(1, static_cast<int>(step.norm() / 1.5F));
  const Finish leaves{Material::kFoliage, Vector3f(0.06F, 0.12F, 0.035F), site.random.Bits()};
  for (int i = 0; i < num_pieces; ++i) {
    const float t = (static_cast<float>(i) + 0.5F) / static_cast<float>(num_pieces);
    const Vector2f middle = from + t * step;
    if (site.ground.streets.At(middle) < kStreetHalfWidth_m + kPavementWidth_m) continue;
    const Vector2f along = step.normalized();
    const float length_m = 1.05F * step.norm() / static_cast<float>(num_pieces);
    const float height_m = 1.5F + Random(site, -0.2, 0.2);
    AddBlock(site.mesh,
             CentredBlock(terrain.At(middle) + 0.2F * Vector3f::UnitZ(),
                          length_m * Vector3f(along.x(), along.y(), 0),
                          Random(site, 0.7, 0.95) * Vector3f(-along.y(), along.x(), 0),
                          2 * height_m * Vector3f::UnitZ()),
             leaves);
  }
}

// Vegetable beds and a hedge behind the house.
void AddGarden(Site& site, const Terrain& terrain, const PlacedHouse& placed) {
  const Vector2f away = (placed.middle - placed.at_street).normalized();
  const Vector2f aside(-away.y(), away.x());
  const Vector2f behind = placed.middle + 11 * away;
  if (site.random.Chance(0.6)) {
    AddHedge(site, terrain, behind - 9 * aside + 3 * away, behind + 9 * aside + 3 * away);
    AddHedge(site, terrain, placed.middle - 9 * aside - 5 * away, behind - 9 * aside + 3 * away);
  }
  for (int i = 0; i < 3; ++i) {
    if (!site.random.Chance(0.55)) continue;
    const Vector2f middle = behind + (4.5F * static_cast<float>(i) - 4.5F) * aside;
    AddBlock(site.mesh,
             CentredBlock(terrain.At(middle), 3.2F * Vector3f(aside.x(), aside.y(), 0),
                          4 * Vector3f(-aside.y(), aside.x(), 0), 0.7F * Vector3f::UnitZ()),
             {Material::kSoil, Vector3f(0.15F, 0.1F, 0.065F), site.random.Bits()});
  }
}

// A car parked at the side of the street.
void AddCar(Site& site, const Terrain& terrain, const Vector2f& place, const Vector2f& along) {
  const Vector3f x(along.x(), along.y(), 0);
  const Vector3f y(-along.y(), along.x(), 0);
  const Vector3f z = Vector3f::UnitZ();
  const Vector3f base = terrain.At(place);
  const float grey = Random(site, 0.05, 0.6);
  const Vector3f tint(Random(site, 0.5, 1.3), Random(site, 0.5, 1.1), Random(site, 0.5, 1.3));
  const Finish paint{Material::kPaint, (grey * tint).cwiseMin(0.75F), 0};
  const Finish glass{Material::kGlass, Vector3f(0.05F, 0.06F, 0.07F), site.random.Bits()};
  AddBlock(site.mesh, CentredBlock(base + 0.2F * z, 4 * x, 1.6F * y, 0.4F * z),
           {Material::kPaint, Vector3f::Constant(0.03F), 0});
  AddBlock(site.mesh, CentredBlock(base + 0.6F * z, 4.3F * x, 1.75F * y, 0.55F * z), paint);
  AddBlock(site.mesh, CentredBlock(base + 1.1F * z - 0.2F * x, 2.3F * x, 1.5F * y, 0.5F * z),
           glass);
  AddBlock(site.mesh, CentredBlock(base + 1.38F * z - 0.2F * x, 2.1F * x, 1.5F * y, 0.08F * z),
           paint);
}

void AddCars(Site& site, const Terrain& terrain) {
  for (const Polyline& street : site.streets) {
    for (std::size_t i = 1; i + 1 < street.size(); ++i) {
      if (!site.random.Chance(0.4)) continue;
      const Vector2f along = (street[i + 1] - street[i - 1]).normalized();
      const float side = site.random.Chance(0.5) ? 1.0F : -1.0F;
      AddCar(site, terrain, street[i] + side * 1.8F * Vector2f(-along.y(), along.x()), along);
    }
  }
}

// A random place on open ground, or none in a few tries.
std::optional<Vector2f> OpenPlace(Site& site, float room_m, float reach_m) {
  for (int attempt = 0; attempt < 20; ++attempt) {
    const Vector2f place(Random(site, -reach_m, reach_m), Random(site, -reach_m, reach_m));
    if (!IsFree(site, {place, room_m})) continue;
    if (site.ground.paths.At(place) > kPathHalfWidth_m + 0.5F) return place;
  }
  return std::nullopt;
}

void AddPlants(Site& site, const Terrain& terrain) {
  const auto reach_m = static_cast<float>(site.options.half_extent_m);
  for (int i = 0; i < site.options.num_trees; ++i) {
    // Two thirds of them in the village, where they are seen.
    const auto place = OpenPlace(site, 1.5F, i % 3 == 0 ? 0.95F * reach_m : 75);
    if (!place) continue;
    const PlantOptions tree{terrain.At(*place), Random(site, 4.5, 10)};
    if (site.random.Chance(0.25)) {
      AddConifer(site.mesh, tree, site.random);
    } else {
      AddBroadleafTree(site.mesh, tree, site.random);
    }
  }
  for (int i = 0; i < site.options.num_bushes; ++i) {
    const auto place = OpenPlace(site, 0.5F, 80);
    if (place) AddBush(site.mesh, {terrain.At(*place), Random(site, 0.8, 2)}, site.random);
  }
}

}  // namespace

void VillageOptions::Visit(OptionVisitor& visit) {
  visit("seed", seed, "one village for each");
  visit("half_extent_m", half_extent_m, "half side of the terrain, metres");
  visit("relief_m", relief_m, "height of the hills, metres");
  visit("num_trees", num_trees, "trees");
  visit("num_bushes", num_bushes, "bushes");
}

void VillageOptions::Validate() const {
  RequireOption(half_extent_m >= 50 && half_extent_m <= 1000, "half_extent_m", "50 to 1000",
                half_extent_m);
  RequireOption(relief_m >= 0 && relief_m <= 100, "relief_m", "0 to 100", relief_m);
  RequireOption(num_trees >= 0, "num_trees", "at least 0", num_trees);
  RequireOption(num_bushes >= 0, "num_bushes", "at least 0", num_bushes);
}

Scene BuildVillage(const VillageOptions& options) {
  options.Validate();
  const auto seed = static_cast<std::uint32_t>(options.seed);
  Site site{options, {}, {}, {}, {}, RandomNumbers(seed)};
  const auto reach_m = static_cast<float>(options.half_extent_m);
  site.streets = {WindingStreet({0, 0}, 0.25F, reach_m, 7),
                  WindingStreet({6, 0}, 1.75F, reach_m, 5),
                  WindingStreet({-8, 52}, 0.05F, 0.6F * reach_m, 4)};
  site.ground.streets = DistanceField(site.streets, options.half_extent_m);
  site.ground.seed = seed;
  const std::vector<PlacedHouse> houses = PlaceHouses(site);
  std::vector<Polyline> paths = {WindingStreet({0, -45}, 0.5F, 0.7F * reach_m, 9)};
  for (const PlacedHouse& placed : houses) paths.push_back({placed.at_street, placed.middle});
  site.ground.paths = DistanceField(paths, options.half_extent_m);

  const Terrain terrain({options.half_extent_m, options.relief_m, seed}, site.ground);
  terrain.AddTo(site.mesh);
  for (const PlacedHouse& placed : houses) {
    HouseOptions house = placed.house;
    house.base = terrain.At(placed.middle) + 0.3F * Vector3f::UnitZ();
    AddHouse(site.mesh, house, site.random);
    AddGarden(site, terrain, placed);
  }
  AddCars(site, terrain);
  AddPlants(site, terrain);
  return Scene(std::move(site.mesh), std::move(site.ground));
}

}  // namespace mono3d::synthetic
