// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <vector>

#include "synthetic/house.h"
#include "synthetic/site.h"

namespace mono3d::synthetic {

struct PlacedHouse {
  HouseOptions house;  // its base is still to be set on the terrain
  Eigen::Vector2f middle;
  Eigen::Vector2f at_street;
};

// Places for detached houses on both sides of each street, wherever there is room within `reach_m`
// of the origin; `share` of them are taken. Takes their plots.
std::vector<PlacedHouse> PlaceHouses(Site& site, float reach_m, double share = 1);

// The gravel drives of the houses.
std::vector<Polyline> Drives(const std::vector<PlacedHouse>& houses);

// Houses with their gardens, on the terrain.
void AddHouses(Site& site, const std::vector<PlacedHouse>& houses);

}  // namespace mono3d::synthetic
