// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "geometry/surfel_marcher.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

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

}  // namespace

TriangleMesh SurfelMarcher::March() {
  for (const GridCorner& corner : grid_.corners()) {
    if (grid_.IsLowest(corner.index)) MarchCell(corner.index);
  }
  return std::move(mesh_);
}

void SurfelMarcher::MarchCell(const GridIndex& lowest) {
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

void SurfelMarcher::MarchTetrahedron(const std::array<std::uint32_t, 4>& corners) {
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

Eigen::Vector3f SurfelMarcher::Middle(const std::vector<std::uint32_t>& corners) const {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (const std::uint32_t corner : corners) sum += grid_.PointOf(grid_.corners()[corner]);
  return sum / static_cast<float>(corners.size());
}

std::uint32_t SurfelMarcher::VertexOn(std::uint32_t inside, std::uint32_t outside) {
  const std::uint64_t edge =
      std::uint64_t{std::min(inside, outside)} << 32 | std::max(inside, outside);
  const auto [entry, is_new] =
      vertex_of_edge_.try_emplace(edge, static_cast<std::uint32_t>(mesh_.vertices.size()));
  if (!is_new) return entry->second;
  const GridCorner& a = grid_.corners()[inside];
  const GridCorner& b = grid_.corners()[outside];
  const float share = std::clamp(a.distance / (a.distance - b.distance), kMinShare, 1 - kMinShare);
  is_on_border_.push_back(grid_.IsOnBorder(a.index, b.index) ? 1 : 0);
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

void SurfelMarcher::AddTriangle(std::uint32_t a, std::uint32_t b, std::uint32_t c,
                                const Eigen::Vector3f& outwards) {
  const Eigen::Vector3f& p = mesh_.vertices[a];
  const Eigen::Vector3f normal = (mesh_.vertices[b] - p).cross(mesh_.vertices[c] - p);
  if (normal.dot(outwards) < 0) std::swap(b, c);
  mesh_.triangles.push_back({a, b, c});
}

}  // namespace mono3d
