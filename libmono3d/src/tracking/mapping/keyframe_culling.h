// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/tracking/tracker.h"
#include "tracking/map/map.h"

namespace mono3d::tracking {

// Removes finalised keyframes of which most points are seen by three others (Mur-Artal, Montiel,
// Tardos 2015, section VI.E).
void CullKeyframes(Map& map, KeyframeId keyframe, const LocalMappingOptions& options);

}  // namespace mono3d::tracking
