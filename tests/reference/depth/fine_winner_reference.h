// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "depth/fine_winner.params.h"
#include "reference/depth/fine_sgm_reference.h"
#include "reference/depth/winner_takes_all_reference.h"

namespace mono3d::reference {

// The best of the 16 planes of each pixel by the sum of the paths (fine_winner.glsl).
Winners FineWinners(const std::vector<FineVolume>& paths, const FineVolume& costs,
                    const std::vector<FineRange>& ranges, const FineWinnerParams& params);

}  // namespace mono3d::reference
