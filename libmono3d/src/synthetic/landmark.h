// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "synthetic/settlement.h"
#include "synthetic/site.h"

namespace mono3d::synthetic {

enum class Landmark {
  kMansion,    // a large house with two wings and a portico, in a park
  kChurch,     // a nave and a tower with a spire
  kWarehouse,  // a hall with bare walls and a flat roof, containers on a yard
};

// One large building at the origin on level ground, amid lawn and trees; a street with houses
// passes at a distance.
std::vector<PlacedHouse> LayLandmark(Site& site, Landmark landmark);
void AddLandmark(Site& site, Landmark landmark, const std::vector<PlacedHouse>& houses);

}  // namespace mono3d::synthetic
