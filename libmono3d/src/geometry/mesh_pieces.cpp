// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "geometry/mesh_pieces.h"

#include <algorithm>
#include <numeric>

namespace mono3d {

// Union-find.
std::vector<std::uint32_t> FindPieces(const TriangleMesh& mesh) {
  std::vector<std::uint32_t> parent(mesh.vertices.size());
  std::iota(parent.begin(), parent.end(), 0U);
  const auto root = [&](std::uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (const auto& [a, b, c] : mesh.triangles) {
    for (const std::uint32_t other : {b, c}) {
      const std::uint32_t one = root(a);
      const std::uint32_t two = root(other);
      parent[std::max(one, two)] = std::min(one, two);
    }
  }
  for (std::uint32_t v = 0; v < parent.size(); ++v) parent[v] = root(v);
  return parent;
}

std::vector<std::size_t> CountTrianglesOfPieces(const TriangleMesh& mesh,
                                                const std::vector<std::uint32_t>& piece) {
  std::vector<std::size_t> num_triangles(mesh.vertices.size(), 0);
  for (const auto& triangle : mesh.triangles) ++num_triangles[piece[triangle[0]]];
  return num_triangles;
}

}  // namespace mono3d
