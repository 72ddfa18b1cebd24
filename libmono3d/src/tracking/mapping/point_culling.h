// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "tracking/map/map.h"

namespace mono3d::tracking {

// For each point of the covisible keyframes: counts whether the new keyframe should show it (in
// view, and as it looked before: LooksAlike) and whether it does. Points created with the keyframe
// are not counted. To be called after its points were matched.
void CountShown(Map& map, KeyframeId keyframe);

// Removes new points that were rarely found or that too few keyframes see, and old points that few
// of the many keyframes show that should. Without the latter each visit of a place leaves points
// behind that no later visit finds, and with them keyframes that are not redundant.
void CullPoints(Map& map);

}  // namespace mono3d::tracking
