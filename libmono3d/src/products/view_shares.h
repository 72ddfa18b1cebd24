// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "mono3d/geometry/triangle_mesh.h"
#include "products/triangle_views.h"
#include "products/view_choice.h"

namespace mono3d {

// What a view adds to the colour of the surface at a vertex. Between the corners of a triangle
// shares and adjustments are linear, so that colours have no steps where the chosen view changes.
struct ViewShare {
  std::uint32_t view = 0;
  float share = 0;                                       // 0 to 1
  Eigen::Vector3f adjustment = Eigen::Vector3f::Zero();  // to be added; blue, green, red
};
using ViewShares = std::vector<std::vector<ViewShare>>;  // of each vertex; empty: no view shows it

// The share of each view among the triangles around a vertex, by area, evened out over a few rings
// of neighbours. `num_blended` views of each triangle count, the chosen one and then the best ones.
ViewShares ShareViews(const TriangleMesh& mesh, const TriangleViews& views,
                      const std::vector<std::uint32_t>& chosen, int num_blended);

// Sets the adjustments: the smoothest ones with which the views that meet at a vertex agree about
// its colour there (Lempitsky and Ivanov 2007).
void LevelSeams(const TriangleMesh& mesh, const TriangleViews& views,
                std::span<const Eigen::Vector3f> gains, ViewShares& shares);

}  // namespace mono3d
