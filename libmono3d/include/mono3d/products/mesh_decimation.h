// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>

#include "mono3d/core/export.h"
#include "mono3d/geometry/triangle_mesh.h"

namespace MONO3D_EXPORT mono3d {

struct DecimatedMesh {
  TriangleMesh mesh;
  double error_su = 0;  // how far the surface moved, at most, as its quadrics tell
};

// The mesh with at most `max_triangles`, by collapsing edges where that moves the surface least
// (Garland and Heckbert 1997); one that has fewer stays as it is. Open borders keep their shape.
// Normals are anew those of the triangles. `keeps_borders`: no vertex of a border moves or goes, so
// that parts of a mesh still meet; they may then keep more triangles. Throws Error when a triangle
// names a vertex that is not there or a vertex is not finite.
DecimatedMesh Decimate(const TriangleMesh& mesh, std::size_t max_triangles,
                       bool keeps_borders = false);

}  // namespace mono3d
