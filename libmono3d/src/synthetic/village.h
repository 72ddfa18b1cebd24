// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/core/options.h"
#include "synthetic/planting.h"
#include "synthetic/scene.h"
#include "synthetic/settlement.h"
#include "synthetic/site.h"

namespace mono3d::synthetic {

struct VillageOptions {
  int seed = 1;
  double half_extent_m = 190;  // of the square of terrain around the origin
  double relief_m = 9;         // how far hills and hollows are from the mean height
  int num_trees = 170;
  int num_bushes = 150;

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

// Houses with gardens along three streets on hilly ground, trees, hedges, cars and fields. The
// streets meet near the origin.
Scene BuildVillage(const VillageOptions& options = {});

// The two halves of it: streets, plots and paths; then, once water is laid, the ground and what
// stands on it.
struct VillagePlan {
  std::vector<PlacedHouse> houses;
};
VillagePlan LayVillage(Site& site);
void AddVillage(Site& site, const VillagePlan& plan, const PlantingOptions& plants);

}  // namespace mono3d::synthetic
