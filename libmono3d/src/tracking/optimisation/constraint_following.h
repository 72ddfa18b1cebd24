// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "tracking/map/map.h"
#include "tracking/priority_mutex.h"

namespace mono3d::tracking {

// Decides on the new constraints. One that the map does not contradict is kept. For one that it
// does the pose graph is moved: where all edges can agree with it, at what a tracker may drift by
// from one keyframe to the next, the map follows and it is kept; else it is dropped, and the map is
// as it was. True when the map has moved; then everything is adjusted, unless the map is shared.
bool FollowConstraints(Map& map, MappingLock& lock);

}  // namespace mono3d::tracking
