// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/evaluation/mesh_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "mono3d/core/error.h"
#include "mono3d/evaluation/cloud_search.h"

namespace mono3d {
namespace {

// Among the nearest surfels the one that is nearest in its radii: radii hardly change between
// neighbours.
constexpr int kNeighbours = 8;

void Append(const std::vector<Eigen::Vector3f>& points, const char* what,
            std::vector<Eigen::Vector3d>& all) {
  for (const Eigen::Vector3f& point : points) {
    if (!point.allFinite()) {
      throw Error(ErrorParts{"cannot compare mesh and surfels", what, "finite numbers", "others"});
    }
    all.push_back(point.cast<double>());
  }
}

void RequireSamples(bool is_so, const std::string& expected, const std::string& found) {
  if (!is_so) throw Error(ErrorParts{"cannot compare mesh and surfels", "model", expected, found});
}

}  // namespace

MeshFit FitOfMesh(const TriangleMesh& mesh, const PointCloud& samples, const PointCloud& surfels) {
  RequireSamples(!samples.empty() && !surfels.empty(), "points on the mesh and surfels", "none");
  RequireSamples(
      surfels.radii.size() == surfels.size() &&
          std::ranges::all_of(surfels.radii,
                              [](float radius) { return std::isfinite(radius) && radius > 0; }),
      "a radius above 0 for each surfel", "others");
  std::vector<Eigen::Vector3d> p_mesh;
  Append(samples.points, "points on the mesh", p_mesh);
  std::vector<Eigen::Vector3d> p_surfels;
  Append(surfels.points, "surfels", p_surfels);
  MeshFit fit;
  const int count = static_cast<int>(std::min<std::size_t>(kNeighbours, p_surfels.size()));
  const std::vector<std::uint32_t> near = CloudSearch(p_surfels).Nearest(p_mesh, count);
  std::size_t num_unsupported = 0;
  for (std::size_t i = 0; i < p_mesh.size(); ++i) {
    double gap = std::numeric_limits<double>::max();
    for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
      const std::uint32_t surfel = near[i * static_cast<std::size_t>(count) + k];
      gap = std::min(gap, (p_mesh[i] - p_surfels[surfel]).norm() / surfels.radii[surfel]);
    }
    num_unsupported += gap > kSupportRadii ? 1 : 0;
    fit.largest_gap_radii = std::max(fit.largest_gap_radii, gap);
  }
  fit.unsupported_share = static_cast<double>(num_unsupported) / static_cast<double>(p_mesh.size());

  Append(mesh.vertices, "vertices of the mesh", p_mesh);
  const std::vector<std::uint32_t> on_mesh = CloudSearch(p_mesh).Nearest(p_surfels);
  std::size_t num_missed = 0;
  for (std::size_t i = 0; i < p_surfels.size(); ++i) {
    const double distance = (p_surfels[i] - p_mesh[on_mesh[i]]).norm();
    num_missed += distance > kSupportRadii * surfels.radii[i] ? 1 : 0;
  }
  fit.missed_share = static_cast<double>(num_missed) / static_cast<double>(p_surfels.size());
  return fit;
}

}  // namespace mono3d
