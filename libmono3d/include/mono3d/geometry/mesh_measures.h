// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>

#include "mono3d/core/export.h"
#include "mono3d/geometry/point_cloud.h"
#include "mono3d/geometry/triangle_mesh.h"

namespace MONO3D_EXPORT mono3d {

// How the triangles of a mesh hang together, by the vertices that they share.
struct MeshTopology {
  std::size_t num_pieces = 0;                // connected ones
  std::size_t num_triangles_of_largest = 0;  // of the piece that has most
  std::size_t num_edges = 0;
  std::size_t num_open_edges = 0;       // of one triangle: borders and holes
  std::size_t num_crowded_edges = 0;    // of more than two triangles
  std::size_t num_flat_triangles = 0;   // without an area
  std::size_t num_unused_vertices = 0;  // of no triangle
};

// Throws Error when a triangle names a vertex that is not there.
MeshTopology ComputeTopology(const TriangleMesh& mesh);

// Of all triangles, su^2. Throws Error when a triangle names a vertex that is not there.
double ComputeArea(const TriangleMesh& mesh);

// `num_points` points, spread at random over the triangles, evenly by area, with the normals of the
// triangles and, where the mesh has them, the colours of its vertices between these. The same seed
// gives the same points. Throws Error when the mesh has no area, a vertex is not finite, or a
// triangle names one that is not there.
PointCloud SampleMesh(const TriangleMesh& mesh, std::size_t num_points, std::uint32_t seed);

}  // namespace mono3d
