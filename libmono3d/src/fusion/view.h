// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>

#include "fusion/view.params.h"
#include "mono3d/fusion/surfel_map.h"
#include "mono3d/image/depth_map.h"

namespace mono3d {

// The steepest surface of which a depth map shows more than its edge; tan of it is the change of
// depth per unit of image plane.
inline constexpr double kMaxSlantDeg = 75;

// The parameters of all stages for one depth map that meets a model of `num_surfels` slots. The
// map's images play no part.
ViewParams MakeViewParams(const DepthMap& map, const SurfelMapOptions& options,
                          std::uint32_t num_surfels, std::uint32_t map_index);

}  // namespace mono3d
