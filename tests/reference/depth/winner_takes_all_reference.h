// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <vector>

#include "depth/winner_takes_all.params.h"

namespace mono3d::reference {

struct Winners {
  std::vector<float> inverse_depth;  // 1/su; 0: no estimate
  std::vector<float> uniqueness;
};

// `sums` and `costs` hold params.padded_planes values for each pixel.
Winners WinnerTakesAll(const std::vector<std::uint16_t>& sums,
                       const std::vector<std::uint8_t>& costs, const WinnerTakesAllParams& params);

}  // namespace mono3d::reference
