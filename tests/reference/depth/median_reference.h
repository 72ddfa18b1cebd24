// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "depth/median.params.h"

namespace mono3d::reference {

struct FilteredDepth {
  std::vector<float> inverse_depth;
  std::vector<float> confidence;
};

// 5x5 median over the pixels with an estimate, the upper one of an even number; borders repeated.
FilteredDepth Median5x5(const std::vector<float>& inverse_depth,
                        const std::vector<float>& confidence, const MedianParams& params);

}  // namespace mono3d::reference
