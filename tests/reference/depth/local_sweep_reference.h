// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <vector>

#include "depth/local_sweep.params.h"
#include "depth/sweep_geometry.h"
#include "reference/depth/local_sgm_reference.h"

namespace mono3d::reference {

// The census of half of the neighbours of each image: the reference, then the sources.
using LocalCensus = std::vector<std::vector<std::uint32_t>>;

// Costs of the 16 planes of each pixel (local_sweep.comp), each plane projected for itself.
LocalVolume LocalSweep(const LocalCensus& census, const SourceProjections& projections,
                       const std::vector<LocalRange>& ranges, const LocalSweepParams& params,
                       int side_tolerance);

}  // namespace mono3d::reference
