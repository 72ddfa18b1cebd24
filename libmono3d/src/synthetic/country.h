// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "synthetic/settlement.h"
#include "synthetic/site.h"

namespace mono3d::synthetic {

// Flat farmland: fields, one street, a few farmhouses, rows of trees.
std::vector<PlacedHouse> LayFields(Site& site);
void AddFields(Site& site, const std::vector<PlacedHouse>& houses);

// Meadows and woods on steep hills, paths, a winding street with a few houses.
std::vector<PlacedHouse> LayHills(Site& site);
void AddHills(Site& site, const std::vector<PlacedHouse>& houses);

}  // namespace mono3d::synthetic
