// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>

#include "mono3d/geometry/point_cloud.h"
#include "mono3d/geometry/similarity.h"

namespace mono3d {

// A house with a pitched roof on ground 20 m wide, of points drawn evenly from its surfaces, with a
// shed beside it so that no two sides look alike. Metres, z up, the ground at z = 0. With normals
// and colours when asked for.
PointCloud HouseCloud(std::size_t num_points, std::uint32_t seed, bool with_normals = false);

// `angle_deg` around (1, 2, 3), `scale`, and a shift.
Similarity TestSimilarity(double angle_deg, double scale, const Eigen::Vector3d& shift);

// The largest distance between where the two put a corner of the box 20 m wide around the house.
double LargestCornerDistance(const Similarity& a, const Similarity& b);

}  // namespace mono3d
