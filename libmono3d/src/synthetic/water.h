// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "synthetic/site.h"

namespace mono3d::synthetic {

struct WaterOptions {
  Polyline middle;  // two places or more
  float half_width_m = 6;
};

// Lays a river or pond into the ground, lower than the terrain along it. Before the terrain is
// laid and plots are taken; hills must be known.
void LayWater(Site& site, const WaterOptions& options);

// A river across the site, through (0, y) and on beyond the horizon.
WaterOptions River(const Site& site, float y_m);
// A pond of some 20 m, with its middle there.
WaterOptions Pond(const Eigen::Vector2f& middle);

// The water's surface, and a bridge for each street that meets it. After the terrain.
void AddWater(Site& site, const WaterOptions& options);

}  // namespace mono3d::synthetic
