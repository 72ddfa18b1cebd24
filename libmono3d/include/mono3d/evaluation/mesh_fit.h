// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/core/export.h"
#include "mono3d/geometry/point_cloud.h"
#include "mono3d/geometry/triangle_mesh.h"

namespace MONO3D_EXPORT mono3d {

// A surfel speaks for its surroundings up to so many of its radii: surfels lie about half a radius
// apart, so that what lies further off was bridged or invented.
inline constexpr double kSupportRadii = 2;

// How a mesh lies to the surfels it was made of; both in the same frame and unit.
struct MeshFit {
  double unsupported_share = 0;  // of the mesh's area: without a surfel within kSupportRadii
  double largest_gap_radii = 0;  // of a point on the mesh to a surfel, in radii of that surfel
  double missed_share = 0;       // of the surfels: without mesh within kSupportRadii
};

// `samples`: points on the mesh, evenly by area (SampleMesh); the more the finer. `surfels` need
// radii. Throws Error when there are no samples, surfels, or radii, or a number is not finite.
MeshFit FitOfMesh(const TriangleMesh& mesh, const PointCloud& samples, const PointCloud& surfels);

}  // namespace mono3d
