// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>

#include "synthetic/site.h"

namespace mono3d::synthetic {

struct PlantingOptions {
  int num_trees = 170;
  int num_bushes = 150;
  float tree_reach_m = 75;  // two thirds of the trees stand within, where they are seen
  float bush_reach_m = 80;
  double conifer_share = 0.25;
};
// Trees and bushes on open ground.
void AddPlants(Site& site, const PlantingOptions& options);

void AddTree(Site& site, const Eigen::Vector2f& place, double conifer_share);

// A hedge between two places, in pieces that follow the ground; not across streets.
void AddHedge(Site& site, const Eigen::Vector2f& from, const Eigen::Vector2f& to);

}  // namespace mono3d::synthetic
