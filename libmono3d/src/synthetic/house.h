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
  float roof_slope = 0.85F;        // rise over run
  float gable_overhang_m = 0.55F;  // of the roof; 0 in a row of houses
  bool has_gable_windows = true;
  double window_share = 0.88;  // of the places for one
  double shutter_share = 0.7;  // of the windows
  double panel_share = 0.6;    // probability of roof windows or solar panels
  Finish wall;
  Finish roof;
};

// Walls, gables, roof, windows with sills and shutters, door, chimney. `random` chooses the
// details.
void AddHouse(Mesh& mesh, const HouseOptions& options, RandomNumbers& random);

// A house of random size and colours.
HouseOptions RandomHouse(RandomNumbers& random);

}  // namespace mono3d::synthetic
