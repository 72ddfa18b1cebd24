// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>

#include "synthetic/mesh.h"
#include "synthetic/noise.h"

namespace mono3d::synthetic {

// A house with a pitched roof: its ridge runs along its own x axis.
struct HouseOptions {
  Eigen::Vector3f base = Eigen::Vector3f::Zero();  // middle of the floor, on the ground
  float yaw_rad = 0;                               // of its x axis
  float length_m = 11;                             // along the ridge
  float width_m = 8.5F;
  int num_storeys = 2;
  float roof_slope = 0.85F;  // rise over run
  Finish wall;
  Finish roof;
};

// Walls, gables, roof, windows with sills and shutters, door, chimney. `random` chooses the
// details.
void AddHouse(Mesh& mesh, const HouseOptions& options, RandomNumbers& random);

// A house of random size and colours.
HouseOptions RandomHouse(RandomNumbers& random);

}  // namespace mono3d::synthetic
