// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/tracking/tracker.h"
#include "tracking/map/map.h"

namespace mono3d::tracking {

// Points of the keyframe and of its neighbours that show at the same feature become one, or gain
// the observation they lacked.
void FusePoints(Map& map, KeyframeId keyframe, const LocalMappingOptions& options);

}  // namespace mono3d::tracking
