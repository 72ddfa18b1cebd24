// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/village.h"

#include <utility>
#include <vector>

#include "synthetic/car.h"
#include "synthetic/planting.h"
#include "synthetic/settlement.h"

namespace mono3d::synthetic {

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

VillagePlan LayVillage(Site& site) {
  const auto reach_m = static_cast<float>(site.terrain.half_extent_m);
  LayStreets(site, {Winding({{0, 0}, 0.25F, reach_m, 7}), Winding({{6, 0}, 1.75F, reach_m, 5}),
                    Winding({{-8, 52}, 0.05F, 0.6F * reach_m, 4})});
  site.routes = {site.streets[0], site.streets[2]};
  constexpr float kVillageReach_m = 120;
  VillagePlan plan{PlaceHouses(site, kVillageReach_m)};
  std::vector<Polyline> paths = Drives(plan.houses);
  paths.push_back(Winding({{0, -45}, 0.5F, 0.7F * reach_m, 9}));
  LayPaths(site, paths);
  return plan;
}

void AddVillage(Site& site, const VillagePlan& plan, const PlantingOptions& plants) {
  LayTerrain(site);
  AddHouses(site, plan.houses);
  AddParkedCars(site, 0.4);
  AddPlants(site, plants);
}

Scene BuildVillage(const VillageOptions& options) {
  options.Validate();
  Site site(static_cast<std::uint32_t>(options.seed));
  site.terrain.half_extent_m = options.half_extent_m;
  site.terrain.relief_m = options.relief_m;
  site.terrain.seed = site.ground.seed;
  const VillagePlan plan = LayVillage(site);
  PlantingOptions plants;
  plants.num_trees = options.num_trees;
  plants.num_bushes = options.num_bushes;
  AddVillage(site, plan, plants);
  return Scene(std::move(site.mesh), std::move(site.ground));
}

}  // namespace mono3d::synthetic
