// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "tracking/map/map.h"

namespace mono3d::tracking {

// Counts for each point of the keyframes around a new one whether that shows it where it should: in
// view, and as it looked before (LooksAlike). Points that the keyframe itself brought do not count.
// Once its points have been matched.
void CountShown(Map& map, KeyframeId keyframe);

// Points go that were rarely found while they were new, or that too few keyframes came to see, or
// later, that hardly any of the many keyframes show that should. Without the latter each visit
// leaves points behind which no later one finds, and keyframes which must stay for their sake.
void CullPoints(Map& map);

}  // namespace mono3d::tracking
