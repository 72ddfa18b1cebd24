// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "geometry/mesh_pieces.h"

#include "core/disjoint_sets.h"

namespace mono3d {

std::vector<std::uint32_t> FindPieces(const TriangleMesh& mesh) {
  DisjointSets<std::uint32_t> pieces(mesh.vertices.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    pieces.Join(a, b);
    pieces.Join(a, c);
  }
  std::vector<std::uint32_t> piece_of(mesh.vertices.size());
  for (std::uint32_t v = 0; v < piece_of.size(); ++v) piece_of[v] = pieces.Find(v);
  return piece_of;
}

std::vector<std::size_t> CountTrianglesOfPieces(const TriangleMesh& mesh,
                                                const std::vector<std::uint32_t>& piece) {
  std::vector<std::size_t> num_triangles(mesh.vertices.size(), 0);
  for (const auto& triangle : mesh.triangles) ++num_triangles[piece[triangle[0]]];
  return num_triangles;
}

TriangleMesh PiecesOf(const TriangleMesh& mesh, const std::vector<std::uint32_t>& piece,
                      const std::function<bool(std::uint32_t)>& is_kept) {
  TriangleMesh kept;
  std::vector<std::uint32_t> new_index(mesh.vertices.size(), 0);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (!is_kept(piece[v])) continue;
    new_index[v] = static_cast<std::uint32_t>(kept.vertices.size());
    kept.vertices.push_back(mesh.vertices[v]);
    kept.normals.push_back(mesh.normals[v]);
    if (!mesh.colours.empty()) kept.colours.push_back(mesh.colours[v]);
  }
  for (const auto& [a, b, c] : mesh.triangles) {
    if (!is_kept(piece[a])) continue;
    kept.triangles.push_back({new_index[a], new_index[b], new_index[c]});
  }
  return kept;
}

}  // namespace mono3d
