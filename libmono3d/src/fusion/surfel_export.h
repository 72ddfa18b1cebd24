// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "fusion/surfel.h"
#include "mono3d/geometry/point_cloud.h"

namespace mono3d {

// The surfels with at least `min_observations` observations that are not removed, in their order;
// the fields as SurfelMap::Export states them.
PointCloud ToPointCloud(const Surfels& surfels, int min_observations);

}  // namespace mono3d
