// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "synthetic/site.h"

namespace mono3d::synthetic {

// Straight streets in two directions; between them blocks of row houses with gardens, blocks of
// flats, squares with trees, car parks. The houses of a row are alike, tile by tile.
struct TownPlan {
  float yaw_rad = 0;
};
TownPlan LayTown(Site& site);
void AddTown(Site& site, const TownPlan& plan);  // lays the terrain, too

}  // namespace mono3d::synthetic
