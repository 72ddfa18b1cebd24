// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <span>

#include "evaluation/cloud_surface.h"
#include "mono3d/evaluation/cloud_error.h"
#include "mono3d/geometry/similarity.h"

namespace mono3d {

// What ComputeCloudError does (see there), on prepared clouds, the estimate in its own frame and
// unit. Neighbours do not change under a similarity, so that one search serves every alignment.
CloudError ComputeCloudError(const CloudSurface& estimate, const Similarity& S_truth_estimate,
                             const CloudSurface& truth, std::span<const double> thresholds_m);

}  // namespace mono3d
