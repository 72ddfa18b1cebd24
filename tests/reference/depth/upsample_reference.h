// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "depth/upsample.params.h"
#include "reference/depth/median_reference.h"

namespace mono3d::reference {

// Inverse depth and confidence at full resolution: bilinear among the coarse pixels that agree with
// the nearest one.
FilteredDepth Upsample(const FilteredDepth& coarse, const UpsampleParams& params);

}  // namespace mono3d::reference
