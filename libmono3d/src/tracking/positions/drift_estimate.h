// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "tracking/positions/positioned_path.h"

namespace mono3d::tracking {

struct DriftEstimate {
  PathNoise noise;
  std::vector<char> is_outlier;  // of each position
};

// How the path drifts and the positions err: what explains the positions best (maximum a posteriori
// over DriftFilter's likelihood), beside what trackers and receivers do in general. So the size of
// the errors of either is never taken from what is left after the path has been moved.
DriftEstimate EstimateDrift(const PositionedPath& path);

}  // namespace mono3d::tracking
