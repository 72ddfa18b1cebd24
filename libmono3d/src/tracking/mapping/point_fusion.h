// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/tracking/tracker.h"
#include "tracking/map/map.h"

namespace mono3d::tracking {

// Merges points of the keyframe and of its covisible neighbours that show at the same feature, and
// adds observations that are missing.
void FusePoints(Map& map, KeyframeId keyframe, const LocalMappingOptions& options);

}  // namespace mono3d::tracking
