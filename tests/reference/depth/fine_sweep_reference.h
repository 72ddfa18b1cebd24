// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <vector>

#include "depth/fine_sweep.params.h"
#include "depth/sweep_geometry.h"
#include "reference/depth/fine_sgm_reference.h"

namespace mono3d::reference {

// The census of half of the neighbours of each image: the reference, then the sources.
using FineCensus = std::vector<std::vector<std::uint32_t>>;

// Costs of the 16 planes of each pixel (fine_sweep.comp), each plane projected for itself.
FineVolume FineSweep(const FineCensus& census, const SourceProjections& projections,
                     const std::vector<FineRange>& ranges, const FineSweepParams& params,
                     int side_tolerance);

}  // namespace mono3d::reference
