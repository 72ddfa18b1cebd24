// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/core/options.h"
#include "mono3d/geometry/point_cloud.h"

namespace MONO3D_EXPORT mono3d {

// Triangles that share vertices; their corners run counter-clockwise as seen from outside.
struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;             // su
  std::vector<Eigen::Vector3f> normals;              // unit length, outwards; one per vertex
  std::vector<std::array<std::uint8_t, 3>> colours;  // red, green, blue; one per vertex, or none
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

struct MeshOptions {
  double voxel_radii = 2;   // edge of a cell of the grid, in radii of the median surfel
  int min_triangles = 100;  // connected pieces of fewer are left out

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

// The surface through the surfels: the zeros of the distance to their tangent planes, averaged by
// confidence and nearness (implicit moving least squares, Kolluri 2005), on the cells of a grid
// near them, by marching tetrahedra (Doi and Koide 1991). There is no surface where there are no
// surfels, but for holes of up to three cells; where the surfels close, so does the mesh. The cloud
// needs normals and radii; without confidences all count alike. Nothing here is a length.
// Throws Error on a cloud that is empty, lacks these, or has lists of differing lengths or numbers
// that are not finite.
TriangleMesh MeshSurfels(const PointCloud& surfels, const MeshOptions& options = {});

}  // namespace mono3d
