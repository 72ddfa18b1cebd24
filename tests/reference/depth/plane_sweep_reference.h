// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <vector>

#include "depth/plane_sweep.params.h"
#include "depth/sweep_geometry.h"

namespace mono3d::reference {

// The census of each image: the reference, then the sources.
using CensusImages = std::vector<std::vector<std::uint64_t>>;

// Of the costs of two sides: their mean, rounded down, at most `tolerance` more than the better
// one; 255: not seen.
int BothSides(int before, int after, int tolerance);

// Costs of all planes, params.padded_planes of each pixel together: twice the mean Hamming distance
// over both sides, at most `side_tolerance` more than that of the better one; 255 where no source
// sees the point and beyond params.num_planes.
std::vector<std::uint8_t> PlaneSweep(const CensusImages& census,
                                     const SourceProjections& projections,
                                     const PlaneSweepParams& params, int side_tolerance);

}  // namespace mono3d::reference
