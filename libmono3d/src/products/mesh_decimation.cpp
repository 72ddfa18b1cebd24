// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/products/mesh_decimation.h"

#include <meshoptimizer.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <string>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

void RequireWholeMesh(const TriangleMesh& mesh) {
  for (const Eigen::Vector3f& vertex : mesh.vertices) {
    if (!vertex.allFinite()) throw Error("decimation: a vertex is not finite");
  }
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t corner : triangle) {
      if (corner >= mesh.vertices.size()) {
        throw Error(ErrorParts{"decimation: a triangle names a vertex that is not there",
                               {},
                               "less than " + std::to_string(mesh.vertices.size()),
                               std::to_string(corner)});
      }
    }
  }
}

// Without the vertices of no triangle.
TriangleMesh WithTriangles(const TriangleMesh& mesh, const std::vector<std::uint32_t>& corners) {
  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> new_of_old(mesh.vertices.size(), kUnused);
  TriangleMesh smaller;
  for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
    std::array<std::uint32_t, 3> triangle{};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t old = corners[i + k];
      if (new_of_old[old] == kUnused) {
        new_of_old[old] = static_cast<std::uint32_t>(smaller.vertices.size());
        smaller.vertices.push_back(mesh.vertices[old]);
        if (!mesh.colours.empty()) smaller.colours.push_back(mesh.colours[old]);
      }
      triangle.at(k) = new_of_old[old];
    }
    smaller.triangles.push_back(triangle);
  }
  smaller.normals.assign(smaller.vertices.size(), Eigen::Vector3f::Zero());
  for (const auto& [a, b, c] : smaller.triangles) {
    // As long as twice the area: each triangle counts by it.
    const Eigen::Vector3f normal = (smaller.vertices[b] - smaller.vertices[a])
                                       .cross(smaller.vertices[c] - smaller.vertices[a]);
    for (const std::uint32_t corner : {a, b, c}) smaller.normals[corner] += normal;
  }
  for (Eigen::Vector3f& normal : smaller.normals) {
    const float length = normal.norm();
    normal = length > 0 ? Eigen::Vector3f(normal / length) : Eigen::Vector3f::UnitZ();
  }
  return smaller;
}

}  // namespace

DecimatedMesh Decimate(const TriangleMesh& mesh, std::size_t max_triangles, bool keeps_borders) {
  RequireWholeMesh(mesh);
  std::vector<std::uint32_t> corners;
  corners.reserve(3 * mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) {
    corners.insert(corners.end(), triangle.begin(), triangle.end());
  }
  if (mesh.triangles.size() <= max_triangles) return {WithTriangles(mesh, corners), 0};
  const float* positions = mesh.vertices[0].data();
  const std::size_t num_vertices = mesh.vertices.size();
  // It has no default for "as far as it takes": lengths are shares of the extent of the mesh.
  constexpr float kAnyError = 1;
  float error = 0;
  std::vector<std::uint32_t> kept(corners.size());
  kept.resize(meshopt_simplify(kept.data(), corners.data(), corners.size(), positions, num_vertices,
                               sizeof(Eigen::Vector3f), 3 * max_triangles, kAnyError,
                               keeps_borders ? meshopt_SimplifyLockBorder : 0, &error));
  return {WithTriangles(mesh, kept),
          error * meshopt_simplifyScale(positions, num_vertices, sizeof(Eigen::Vector3f))};
}

}  // namespace mono3d
