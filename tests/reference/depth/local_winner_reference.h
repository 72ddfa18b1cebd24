// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "depth/local_winner.params.h"
#include "reference/depth/local_sgm_reference.h"
#include "reference/depth/winner_takes_all_reference.h"

namespace mono3d::reference {

// The best of the 16 planes of each pixel by the sum of the paths (local_winner.comp).
Winners LocalWinners(const std::vector<LocalVolume>& paths, const LocalVolume& costs,
                     const std::vector<LocalRange>& ranges, const LocalWinnerParams& params);

}  // namespace mono3d::reference
