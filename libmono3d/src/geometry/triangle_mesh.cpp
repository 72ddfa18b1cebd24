// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/triangle_mesh.h"

#include <cmath>
#include <cstddef>
#include <string>

#include "geometry/mesh_pieces.h"
#include "geometry/surfel_grid.h"
#include "geometry/surfel_marcher.h"
#include "mono3d/core/error.h"
#include "mono3d/core/statistics.h"

namespace mono3d {

void RequireMeshable(const PointCloud& surfels) {
  const auto refuse = [](const std::string& expected, const std::string& found) {
    throw Error(ErrorParts{"no surfels to mesh", "model", expected, found});
  };
  if (surfels.empty()) refuse("some surfels", "none");
  if (surfels.normals.size() != surfels.size()) refuse("a normal each", "fewer or more");
  if (surfels.radii.size() != surfels.size()) refuse("a radius each", "fewer or more");
  if ((!surfels.colours.empty() && surfels.colours.size() != surfels.size()) ||
      (!surfels.confidences.empty() && surfels.confidences.size() != surfels.size())) {
    refuse("colours and confidences for all or for none", "for some");
  }
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    if (!surfels.points[i].allFinite() || !surfels.normals[i].allFinite() ||
        !std::isfinite(surfels.radii[i]) || !(surfels.radii[i] > 0)) {
      refuse("finite numbers and positive radii", "surfel " + std::to_string(i));
    }
  }
}

void MeshOptions::Visit(OptionVisitor& visit) {
  visit("voxel_radii", voxel_radii, "edge of a cell, in radii of the median surfel");
  visit("min_triangles", min_triangles, "connected pieces of fewer triangles are left out");
}

void MeshOptions::Validate() const {
  RequireOption(voxel_radii > 0 && std::isfinite(voxel_radii), "mesh.voxel_radii", "> 0",
                voxel_radii);
  RequireOption(min_triangles >= 1, "mesh.min_triangles", "1 or more", min_triangles);
}

TriangleMesh MeshSurfels(const PointCloud& surfels, const MeshOptions& options) {
  options.Validate();
  RequireMeshable(surfels);
  const SurfelGrid grid(surfels, options.voxel_radii * UpperMedian(surfels.radii));
  const TriangleMesh mesh = SurfelMarcher(grid, !surfels.colours.empty()).March();
  const std::vector<std::uint32_t> piece = FindPieces(mesh);
  const std::vector<std::size_t> num_triangles = CountTrianglesOfPieces(mesh, piece);
  return PiecesOf(mesh, piece, [&](std::uint32_t number) {
    return num_triangles[number] >= static_cast<std::size_t>(options.min_triangles);
  });
}

}  // namespace mono3d
