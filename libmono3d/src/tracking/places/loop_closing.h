// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <optional>

#include "mono3d/tracking/tracker.h"
#include "tracking/map/map.h"
#include "tracking/places/place_index.h"
#include "tracking/places/place_matching.h"
#include "tracking/priority_mutex.h"

namespace mono3d::tracking {

// A keyframe that has come back to where an old one, not connected to it, has been: the candidates
// of the index, checked.
std::optional<PlaceFound> FindLoop(Map& map, const PlaceIndex& index, KeyframeId keyframe,
                                   int seed);

// Spreads the error over all keyframes (pose graph over Sim(3)), moves the points along, then
// merges. Keyframes that came meanwhile move along.
void CloseLoop(Map& map, const PlaceFound& loop, const LocalMappingOptions& options,
               MappingLock& lock);

// Makes one of each pair of points, shows the newest keyframes the old points and adjusts
// everything. Who shares the map leaves the adjustment for later: AdjustAllAndScales.
void MergePlaces(Map& map, const PlaceFound& loop, const LocalMappingOptions& options,
                 MappingLock& lock);

}  // namespace mono3d::tracking
