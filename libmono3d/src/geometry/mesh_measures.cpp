// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/mesh_measures.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "geometry/mesh_pieces.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

void RequireVertices(const TriangleMesh& mesh) {
  for (const auto& triangle : mesh.triangles) {
    const std::uint32_t last = *std::max_element(triangle.begin(), triangle.end());
    if (last < mesh.vertices.size()) continue;
    throw Error(ErrorParts{.what = "a triangle without its vertices",
                           .where = "mesh",
                           .expected = std::to_string(mesh.vertices.size()) + " vertices",
                           .found = "number " + std::to_string(last)});
  }
}

// Twice the area long, along the normal.
Eigen::Vector3d CrossOf(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& triangle) {
  const Eigen::Vector3d a = mesh.vertices[triangle[0]].cast<double>();
  const Eigen::Vector3d b = mesh.vertices[triangle[1]].cast<double>();
  const Eigen::Vector3d c = mesh.vertices[triangle[2]].cast<double>();
  return (b - a).cross(c - a);
}

// Number of triangles at each edge, for every edge once.
std::vector<int> CountTrianglesOfEdges(const TriangleMesh& mesh) {
  std::vector<std::uint64_t> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    for (const auto& [from, to] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)}) {
      edges.push_back(std::uint64_t{std::min(from, to)} << 32 | std::max(from, to));
    }
  }
  std::sort(edges.begin(), edges.end());
  std::vector<int> counts;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (i == 0 || edges[i] != edges[i - 1]) counts.push_back(0);
    ++counts.back();
  }
  return counts;
}

}  // namespace

MeshTopology ComputeTopology(const TriangleMesh& mesh) {
  RequireVertices(mesh);
  MeshTopology topology;
  const std::vector<std::size_t> num_triangles = CountTrianglesOfPieces(mesh, FindPieces(mesh));
  for (const std::size_t count : num_triangles) {
    topology.num_pieces += count > 0 ? 1 : 0;
    topology.num_triangles_of_largest = std::max(topology.num_triangles_of_largest, count);
  }
  const std::vector<int> counts = CountTrianglesOfEdges(mesh);
  topology.num_edges = counts.size();
  for (const int count : counts) {
    topology.num_open_edges += count == 1 ? 1 : 0;
    topology.num_crowded_edges += count > 2 ? 1 : 0;
  }
  std::vector<bool> is_used(mesh.vertices.size(), false);
  for (const auto& triangle : mesh.triangles) {
    topology.num_flat_triangles += CrossOf(mesh, triangle).norm() > 0 ? 0 : 1;
    for (const std::uint32_t vertex : triangle) is_used[vertex] = true;
  }
  topology.num_unused_vertices =
      static_cast<std::size_t>(std::count(is_used.begin(), is_used.end(), false));
  return topology;
}

double ComputeArea(const TriangleMesh& mesh) {
  RequireVertices(mesh);
  double twice = 0;
  for (const auto& triangle : mesh.triangles) twice += CrossOf(mesh, triangle).norm();
  return twice / 2;
}

PointCloud SampleMesh(const TriangleMesh& mesh, std::size_t num_points, std::uint32_t seed) {
  RequireVertices(mesh);
  std::vector<double> area_up_to;
  area_up_to.reserve(mesh.triangles.size());
  double sum = 0;
  for (const auto& triangle : mesh.triangles) {
    area_up_to.push_back(sum += CrossOf(mesh, triangle).norm());
  }
  if (!(sum > 0) || !std::isfinite(sum)) {
    throw Error(
        ErrorParts{"no points on the mesh", "mesh", "triangles with a finite area", "none"});
  }
  std::mt19937 random(seed);
  // Not a distribution of the standard library: these differ between implementations.
  const auto share = [&random] { return (static_cast<double>(random()) + 0.5) / 4294967296.0; };
  PointCloud cloud;
  for (std::size_t i = 0; i < num_points; ++i) {
    const auto found = std::upper_bound(area_up_to.begin(), area_up_to.end(), share() * sum);
    const auto& triangle = mesh.triangles[static_cast<std::size_t>(
        std::min(found - area_up_to.begin(), std::ssize(area_up_to) - 1))];
    double b = share();
    double c = share();
    if (b + c > 1) b = 1 - b, c = 1 - c;
    const std::array<double, 3> weights = {1 - b - c, b, c};
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    Eigen::Vector3d colour = Eigen::Vector3d::Constant(0.5);  // rounds
    for (std::size_t k = 0; k < 3; ++k) {
      point += weights[k] * mesh.vertices[triangle[k]].cast<double>();
      if (mesh.colours.empty()) continue;
      const auto& rgb = mesh.colours[triangle[k]];
      colour += weights[k] * Eigen::Vector3d(rgb[0], rgb[1], rgb[2]);
    }
    cloud.points.emplace_back(point.cast<float>());
    cloud.normals.emplace_back(CrossOf(mesh, triangle).normalized().cast<float>());
    if (mesh.colours.empty()) continue;
    cloud.colours.push_back({static_cast<std::uint8_t>(colour[0]),
                             static_cast<std::uint8_t>(colour[1]),
                             static_cast<std::uint8_t>(colour[2])});
  }
  return cloud;
}

}  // namespace mono3d
