// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "mono3d/geometry/triangle_mesh.h"

namespace mono3d {

// The lowest vertex of the connected piece to which each vertex belongs.
std::vector<std::uint32_t> FindPieces(const TriangleMesh& mesh);

// Triangles of the piece whose lowest vertex it is, of every vertex; 0 of the others.
std::vector<std::size_t> CountTrianglesOfPieces(const TriangleMesh& mesh,
                                                const std::vector<std::uint32_t>& piece);

// The pieces for whose lowest vertex `is_kept` holds.
TriangleMesh PiecesOf(const TriangleMesh& mesh, const std::vector<std::uint32_t>& piece,
                      const std::function<bool(std::uint32_t)>& is_kept);

}  // namespace mono3d
