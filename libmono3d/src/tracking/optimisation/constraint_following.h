// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "tracking/map/map.h"
#include "tracking/priority_mutex.h"

namespace mono3d::tracking {

// Decides on the new constraints. One that agrees with the map is kept. For one that does not, the
// pose graph is optimised with it: where all edges then agree with it within the drift of a tracker
// from one keyframe to the next, the keyframes move and the constraint is kept; else it is
// discarded, and the map stays as it was. True when keyframes have moved; then the whole map is
// adjusted, unless another thread shares it or `adjusts` is false.
bool FollowConstraints(Map& map, MappingLock& lock, bool adjusts = true);

}  // namespace mono3d::tracking
