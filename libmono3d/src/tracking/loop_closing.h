// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <optional>

#include "mono3d/tracking/tracker.h"
#include "tracking/map.h"
#include "tracking/place_index.h"
#include "tracking/place_matching.h"

namespace mono3d::tracking {

// A keyframe that has come back to where an old one, not connected to it, has been: the candidates
// of the index, checked.
std::optional<PlaceFound> FindLoop(Map& map, const PlaceIndex& index, KeyframeId keyframe,
                                   int seed);

// Spreads the error over all keyframes (pose graph over Sim(3)), moves the points along, then
// merges.
void CloseLoop(Map& map, const PlaceFound& loop, const LocalMappingOptions& options);

// Makes one of each pair of points, shows the newest keyframes the old points and adjusts
// everything.
void MergePlaces(Map& map, const PlaceFound& loop, const LocalMappingOptions& options);

}  // namespace mono3d::tracking
