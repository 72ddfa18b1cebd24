// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>

#include "synthetic/mesh.h"
#include "synthetic/noise.h"

namespace mono3d::synthetic {

// A building with a flat roof behind a parapet.
struct BuildingOptions {
  Eigen::Vector3f base = Eigen::Vector3f::Zero();  // middle of the floor, on the ground
  float yaw_rad = 0;                               // of its length
  float length_m = 24;
  float width_m = 12;
  int num_storeys = 4;
  bool has_windows = true;  // the same on each storey
  Finish wall;
  Finish roof;
};

// Walls, windows, roof with parapet, and boxes on the roof.
void AddBuilding(Mesh& mesh, const BuildingOptions& options, RandomNumbers& random);

}  // namespace mono3d::synthetic
