// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "mono3d/geometry/triangle_mesh.h"

namespace mono3d {

// A view of a triangle. Views are numbered by their places in the list of views.
struct TriangleView {
  std::uint32_t view = 0;
  float area_px = 0;                        // in the image: the larger, the nearer and more frontal
  std::array<std::uint8_t, 3> colour = {};  // mean, blue, green, red
  bool is_clear = false;                    // see SeenTriangle
};

// The views of each triangle of a mesh, the best kMost: those in which it is clear first, of them
// the largest first.
class TriangleViews {
 public:
  static constexpr std::size_t kMost = 12;

  explicit TriangleViews(std::size_t num_triangles)
      : views_(num_triangles), counts_(num_triangles) {}

  std::size_t num_triangles() const { return views_.size(); }
  std::span<const TriangleView> Of(std::size_t triangle) const {
    return {views_[triangle].data(), counts_[triangle]};
  }
  // Position in Of(triangle), or its size.
  std::size_t Find(std::size_t triangle, std::uint32_t view) const;
  // Takes the place of the last where there are kMost already.
  void Add(std::size_t triangle, const TriangleView& view);

  // Leaves out of each triangle's views those whose colour disagrees with the rest, because
  // something stands or moves in front of it there: beyond three standard deviations (by the median
  // of the absolute deviations) of their median. `gains`: what makes the colours of each view like
  // those of the others.
  void DropOutliers(std::span<const Eigen::Vector3f> gains);
  // Leaves out the views of each triangle in which it is not clear, but where there is no other.
  void DropUnclear();

 private:
  std::vector<std::array<TriangleView, kMost>> views_;
  std::vector<std::uint8_t> counts_;
};

// What the colours of each view are to be multiplied by so that views agree about the triangles
// that they share; the mesh's own colours are one more view, whose gain is 1. Blue, green, red. A
// robust least-squares fit of the logarithms; colours that are clipped or nearly black take no
// part.
std::vector<Eigen::Vector3f> EstimateGains(const TriangleMesh& mesh, const TriangleViews& views,
                                           std::size_t num_views);

}  // namespace mono3d
