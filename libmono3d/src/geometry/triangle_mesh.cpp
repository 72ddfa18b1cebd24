// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/triangle_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>
#include <unordered_map>
#include <utility>

#include "geometry/mesh_pieces.h"
#include "geometry/surfel_grid.h"
#include "mono3d/core/error.h"
#include "mono3d/core/statistics.h"

namespace mono3d {
namespace {

// The corner of a cell that lies at (bit 0, bit 1, bit 2) of its number.
constexpr int kNumCorners = 8;

// Six tetrahedra around the diagonal from corner 0 to corner 7, one per order of the axes: each
// face of a cell is cut from its lowest to its highest corner, so that neighbours meet.
constexpr std::array<std::array<int, 4>, 6> kTetrahedra = {
    {{0, 1, 3, 7}, {0, 1, 5, 7}, {0, 2, 3, 7}, {0, 2, 6, 7}, {0, 4, 5, 7}, {0, 4, 6, 7}}};

// A vertex keeps this share of an edge from its ends: no triangle without an area.
constexpr float kMinShare = 1e-3F;

void RequireSurfels(const PointCloud& surfels) {
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

class Marcher {
 public:
  Marcher(const SurfelGrid& grid, bool with_colours) : grid_(grid), with_colours_(with_colours) {}

  TriangleMesh March() {
    for (const GridCorner& corner : grid_.corners()) MarchCell(corner.index);
    return std::move(mesh_);
  }

 private:
  bool IsOutside(std::uint32_t corner) const { return grid_.corners()[corner].distance >= 0; }

  void MarchCell(const GridIndex& lowest) {
    std::array<std::uint32_t, kNumCorners> corners{};
    int num_outside = 0;
    for (int c = 0; c < kNumCorners; ++c) {
      const auto found =
          grid_.Find({lowest[0] + (c & 1), lowest[1] + (c >> 1 & 1), lowest[2] + (c >> 2)});
      if (!found) return;
      corners.at(static_cast<std::size_t>(c)) = *found;
      num_outside += IsOutside(*found) ? 1 : 0;
    }
    if (num_outside == 0 || num_outside == kNumCorners) return;
    for (const auto& [a, b, c, d] : kTetrahedra) {
      const auto at = [&](int number) { return corners.at(static_cast<std::size_t>(number)); };
      MarchTetrahedron({at(a), at(b), at(c), at(d)});
    }
  }

  void MarchTetrahedron(const std::array<std::uint32_t, 4>& corners) {
    std::vector<std::uint32_t> inside;
    std::vector<std::uint32_t> outside;
    for (const std::uint32_t corner : corners) {
      (IsOutside(corner) ? outside : inside).push_back(corner);
    }
    if (inside.empty() || outside.empty()) return;
    const Eigen::Vector3f outwards = Middle(outside) - Middle(inside);
    if (inside.size() == 2) {  // a quadrilateral
      const std::uint32_t v00 = VertexOn(inside[0], outside[0]);
      const std::uint32_t v01 = VertexOn(inside[0], outside[1]);
      const std::uint32_t v11 = VertexOn(inside[1], outside[1]);
      const std::uint32_t v10 = VertexOn(inside[1], outside[0]);
      AddTriangle(v00, v01, v11, outwards);
      AddTriangle(v00, v11, v10, outwards);
      return;
    }
    std::array<std::uint32_t, 3> vertices{};
    std::size_t next = 0;
    for (const std::uint32_t i : inside) {
      for (const std::uint32_t o : outside) vertices.at(next++) = VertexOn(i, o);
    }
    AddTriangle(vertices[0], vertices[1], vertices[2], outwards);
  }

  Eigen::Vector3f Middle(const std::vector<std::uint32_t>& corners) const {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (const std::uint32_t corner : corners) sum += grid_.PointOf(grid_.corners()[corner]);
    return sum / static_cast<float>(corners.size());
  }

  std::uint32_t VertexOn(std::uint32_t inside, std::uint32_t outside) {
    const std::uint64_t edge =
        std::uint64_t{std::min(inside, outside)} << 32 | std::max(inside, outside);
    const auto [entry, is_new] =
        vertex_of_edge_.try_emplace(edge, static_cast<std::uint32_t>(mesh_.vertices.size()));
    if (!is_new) return entry->second;
    const GridCorner& a = grid_.corners()[inside];
    const GridCorner& b = grid_.corners()[outside];
    const float share =
        std::clamp(a.distance / (a.distance - b.distance), kMinShare, 1 - kMinShare);
    mesh_.vertices.emplace_back((1 - share) * grid_.PointOf(a) + share * grid_.PointOf(b));
    mesh_.normals.emplace_back(((1 - share) * a.normal + share * b.normal).stableNormalized());
    if (with_colours_) {
      const Eigen::Vector3f colour = (1 - share) * a.colour + share * b.colour;
      std::array<std::uint8_t, 3> rounded{};
      for (int c = 0; c < 3; ++c) {
        rounded.at(static_cast<std::size_t>(c)) =
            static_cast<std::uint8_t>(std::clamp(std::lround(colour[c]), 0L, 255L));
      }
      mesh_.colours.push_back(rounded);
    }
    return entry->second;
  }

  void AddTriangle(std::uint32_t a, std::uint32_t b, std::uint32_t c,
                   const Eigen::Vector3f& outwards) {
    const Eigen::Vector3f& p = mesh_.vertices[a];
    const Eigen::Vector3f normal = (mesh_.vertices[b] - p).cross(mesh_.vertices[c] - p);
    if (normal.dot(outwards) < 0) std::swap(b, c);
    mesh_.triangles.push_back({a, b, c});
  }

  const SurfelGrid& grid_;
  bool with_colours_;
  TriangleMesh mesh_;
  std::unordered_map<std::uint64_t, std::uint32_t> vertex_of_edge_;
};

TriangleMesh WithoutSmallPieces(const TriangleMesh& mesh, std::size_t min_triangles) {
  const std::vector<std::uint32_t> piece = FindPieces(mesh);
  const std::vector<std::size_t> num_triangles = CountTrianglesOfPieces(mesh, piece);
  TriangleMesh kept;
  std::vector<std::uint32_t> new_index(mesh.vertices.size(), 0);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (num_triangles[piece[v]] < min_triangles) continue;
    new_index[v] = static_cast<std::uint32_t>(kept.vertices.size());
    kept.vertices.push_back(mesh.vertices[v]);
    kept.normals.push_back(mesh.normals[v]);
    if (!mesh.colours.empty()) kept.colours.push_back(mesh.colours[v]);
  }
  for (const auto& [a, b, c] : mesh.triangles) {
    if (num_triangles[piece[a]] < min_triangles) continue;
    kept.triangles.push_back({new_index[a], new_index[b], new_index[c]});
  }
  return kept;
}

}  // namespace

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
  RequireSurfels(surfels);
  const SurfelGrid grid(surfels, options.voxel_radii * UpperMedian(surfels.radii));
  const TriangleMesh mesh = Marcher(grid, !surfels.colours.empty()).March();
  return WithoutSmallPieces(mesh, static_cast<std::size_t>(options.min_triangles));
}

}  // namespace mono3d
