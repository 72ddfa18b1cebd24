// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "mono3d/geometry/triangle_mesh.h"
#include "products/triangle_views.h"

namespace mono3d {

inline constexpr std::uint32_t kNoTriangle = std::numeric_limits<std::uint32_t>::max();
inline constexpr std::uint32_t kNoView = std::numeric_limits<std::uint32_t>::max();

// The triangle on the other side of each of the three edges, from a corner to the next; kNoTriangle
// at borders and where more than two triangles share an edge.
using TriangleNeighbours = std::vector<std::array<std::uint32_t, 3>>;
TriangleNeighbours FindNeighbours(const TriangleMesh& mesh);

// One view for each triangle, kNoView for those that none shows: sharp ones, and few borders
// between views (a Potts model; Lempitsky and Ivanov 2007, Waechter et al. 2014), by min-sum belief
// propagation.
std::vector<std::uint32_t> ChooseViews(const TriangleViews& views,
                                       const TriangleNeighbours& neighbours);

}  // namespace mono3d
