// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "mono3d/image/keyframe.h"
#include "tracking/map/map.h"

namespace mono3d::tracking {

// Hands out the keyframes that are final, in the order of flight: those that shared a bundle
// adjustment with two newer ones. `all`: every one left. Their images are released here.
std::vector<Keyframe> TakeFinalised(Map& map, bool all);

// Counts a keyframe as adjusted with newer ones as often as it takes to be final.
void MarkAdjusted(Map& map, KeyframeId keyframe);

}  // namespace mono3d::tracking
