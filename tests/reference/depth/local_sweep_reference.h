// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "depth/local_sweep.params.h"
#include "depth/sweep_geometry.h"
#include "reference/depth/local_sgm_reference.h"

namespace mono3d::reference {

// Costs of the 16 planes of each pixel (local_sweep.comp), each plane projected for itself.
// `census` holds the reference and the sources.
LocalVolume LocalSweep(const std::vector<std::vector<std::uint64_t>>& census,
                       const SourceProjections& projections, const std::vector<LocalRange>& ranges,
                       const LocalSweepParams& params);

}  // namespace mono3d::reference
