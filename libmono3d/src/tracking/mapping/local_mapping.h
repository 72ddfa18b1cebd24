// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/core/timing.h"
#include "mono3d/tracking/tracker.h"
#include "tracking/map/map.h"
#include "tracking/priority_mutex.h"

namespace mono3d::tracking {

// All that happens once for each new keyframe: new points, fusion, culling, local bundle
// adjustment.
// The map is given up between the steps and while the adjustment works on its copy.
void MapKeyframeInto(Map& map, KeyframeId keyframe, const LocalMappingOptions& options,
                     StageTimes* times, MappingLock& lock);

}  // namespace mono3d::tracking
