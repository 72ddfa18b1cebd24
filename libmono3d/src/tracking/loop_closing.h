// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <optional>

#include "mono3d/tracking/tracker.h"
#include "tracking/map.h"
#include "tracking/map_turn.h"
#include "tracking/place_index.h"
#include "tracking/place_matching.h"

namespace mono3d::tracking {

// A keyframe that has come back to where an old one, not connected to it, has been: the candidates
// of the index, checked.
std::optional<PlaceFound> FindLoop(Map& map, const PlaceIndex& index, KeyframeId keyframe,
                                   int seed);

// Spreads the error over all keyframes (pose graph over Sim(3)), moves the points along, then
// merges. Keyframes that came meanwhile move along.
void CloseLoop(Map& map, const PlaceFound& loop, const LocalMappingOptions& options,
               MappingTurn& turn);

// Makes one of each pair of points, shows the newest keyframes the old points and adjusts
// everything. Who shares the map leaves the adjustment for later: AdjustMerged.
void MergePlaces(Map& map, const PlaceFound& loop, const LocalMappingOptions& options,
                 MappingTurn& turn);

// Adjusts everything and notes how the lengths around each keyframe have changed. False when it was
// interrupted: what it had found by then is in the map.
bool AdjustMerged(Map& map, MappingTurn& turn);

}  // namespace mono3d::tracking
