// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "synthetic/mesh.h"
#include "synthetic/site.h"

namespace mono3d::synthetic {

// Where a car stands: the ground below its middle, and the way it looks (horizontal, unit length).
struct CarPlace {
  Eigen::Vector3f base;
  Eigen::Vector3f ahead;
};
void AddCar(Mesh& mesh, const CarPlace& place, RandomNumbers& random);

// Cars at the sides of the streets; `share` of the places for one are taken.
void AddParkedCars(Site& site, double share);

// Cars that drive along the streets from end to end, again and again.
void AddDrivingCars(Site& site, int num_cars);

}  // namespace mono3d::synthetic
