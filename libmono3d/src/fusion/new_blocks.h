// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "fusion/view.params.h"
#include "mono3d/geometry/similarity.h"

namespace mono3d {

// What surrounds the surfels of a block, in the frame and unit of their anchor.
struct BlockSphere {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double radius = 0;
};

// Of the surfels that a depth map adds for these pixels, in their order, one sphere for each block
// of kSurfelsPerBlock. `depth`: per pixel of the depth map, as `view` has it.
std::vector<BlockSphere> SpheresOfNew(const ViewParams& view, std::span<const std::uint32_t> pixels,
                                      std::span<const float> depth);

// Numbers of the spheres that reach into the pyramid of `view`, of which a pixel more is taken on
// each side so that no rounding matters.
std::vector<std::uint32_t> SpheresInView(std::span<const BlockSphere> spheres,
                                         const ViewParams& view, const Similarity& S_view_anchor);

}  // namespace mono3d
