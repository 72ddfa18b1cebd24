// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/core/options.h"
#include "synthetic/scene.h"

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

}  // namespace mono3d::synthetic
