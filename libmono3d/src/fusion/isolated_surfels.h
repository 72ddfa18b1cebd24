// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <vector>

#include "mono3d/geometry/point_cloud.h"

namespace mono3d {

// Neighbours of a surfel are those within so many of its radii. A radius is sqrt(2) pixels of the
// image that measured it best, so that these are a disc of some 57 of its pixels.
inline constexpr double kNeighbourRadii = 3;

// Whether each surfel has fewer than `min_neighbours` others near it. The cloud has radii. A
// surfel of more than 32 times the median radius is never isolated here: finding out would cost
// too much.
// Those before `first` are neighbours alone, and not isolated.
std::vector<bool> FindIsolated(const PointCloud& surfels, int min_neighbours,
                               std::size_t first = 0);

// Footprints of neighbouring pixels lie apart by this share of a surfel's radius.
inline constexpr double kFootprintRadii = 0.7071;

// Whether each surfel has one of the `others` within so many of its radii.
std::vector<bool> FindNear(const PointCloud& surfels, const PointCloud& others, double radii);

}  // namespace mono3d
