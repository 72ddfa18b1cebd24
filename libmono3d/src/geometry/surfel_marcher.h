// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "geometry/surfel_grid.h"
#include "mono3d/geometry/triangle_mesh.h"

namespace mono3d {

// The triangles of the cells of a grid whose lowest corner is one of its box, by marching
// tetrahedra. Those of boxes side by side have the vertices on the plane between them in common,
// with the same bits, where their grids have the same origin and were told the same surfels near
// it, in the same order.
class SurfelMarcher {
 public:
  SurfelMarcher(const SurfelGrid& grid, bool with_colours)
      : grid_(grid), with_colours_(with_colours) {}

  TriangleMesh March();
  // Of the vertices of March(): lies it on a plane that bounds the box of the grid?
  const std::vector<char>& is_on_border() const { return is_on_border_; }

 private:
  bool IsOutside(std::uint32_t corner) const { return grid_.corners()[corner].distance >= 0; }
  void MarchCell(const GridIndex& lowest);
  void MarchTetrahedron(const std::array<std::uint32_t, 4>& corners);
  Eigen::Vector3f Middle(const std::vector<std::uint32_t>& corners) const;
  std::uint32_t VertexOn(std::uint32_t inside, std::uint32_t outside);
  void AddTriangle(std::uint32_t a, std::uint32_t b, std::uint32_t c,
                   const Eigen::Vector3f& outwards);

  const SurfelGrid& grid_;
  bool with_colours_;
  TriangleMesh mesh_;
  std::vector<char> is_on_border_;
  std::unordered_map<std::uint64_t, std::uint32_t> vertex_of_edge_;
};

// Throws Error where a mesh cannot be made of these surfels: see MeshSurfels.
void RequireMeshable(const PointCloud& surfels);

}  // namespace mono3d
