// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "tracking/positions/positioned_path.h"

namespace mono3d::tracking {

struct PathFit {
  PathNoise noise;
  std::vector<char> is_outlier;  // of each position
  bool is_found = false;         // else nothing has moved
};

// EstimateDrift and OptimisePath in turn: both linearise, the first one only once.
PathFit FitPath(PositionedPath& path);

}  // namespace mono3d::tracking
