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

// A keyframe shows a place that an old keyframe, not connected to it by common points, has seen:
// the candidates of the index are checked one after the other. Nothing where none passes.
std::optional<PlaceFound> FindLoop(Map& map, const PlaceIndex& index, KeyframeId keyframe,
                                   int seed);

// Spreads the error of the loop over all keyframes (pose graph over Sim(3)), moves the points with
// them, then calls MergePlaces. Keyframes that were added meanwhile move with the loop's newest.
void CloseLoop(Map& map, const PlaceFound& loop, const LocalMappingOptions& options,
               MappingLock& lock);

// Merges the pairs of points that are the same, adds observations of the old points to the newest
// keyframes and adjusts the whole map. Where another thread shares the map, the adjustment is left
// to the caller: AdjustAllAndScales.
void MergePlaces(Map& map, const PlaceFound& loop, const LocalMappingOptions& options,
                 MappingLock& lock);

}  // namespace mono3d::tracking
