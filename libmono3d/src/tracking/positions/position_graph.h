// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "tracking/positions/positioned_path.h"

namespace mono3d::tracking {

// Moves the keyframes of the path to where its edges and positions agree best (pose graph over
// Sim(3)), each weighted by `noise`: the errors of the positions are a wandering part, which is an
// unknown of its own at each of them, and a white one with Cauchy's loss; that their times are all
// off by a little is another unknown; known points have
// Huber's; `is_outlier` take no part. What nothing tells, such as the roll about a straight path,
// stays. False where no solution was found, and nothing moved.
bool OptimisePath(const PathNoise& noise, const std::vector<char>& is_outlier,
                  PositionedPath& path);

}  // namespace mono3d::tracking
