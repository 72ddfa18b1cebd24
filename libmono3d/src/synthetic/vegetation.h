// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>

#include "synthetic/mesh.h"
#include "synthetic/noise.h"

namespace mono3d::synthetic {

struct PlantOptions {
  Eigen::Vector3f base = Eigen::Vector3f::Zero();  // where it leaves the ground
  float height_m = 7;
};

void AddBroadleafTree(Mesh& mesh, const PlantOptions& options, RandomNumbers& random);
void AddConifer(Mesh& mesh, const PlantOptions& options, RandomNumbers& random);
void AddBush(Mesh& mesh, const PlantOptions& options, RandomNumbers& random);

}  // namespace mono3d::synthetic
