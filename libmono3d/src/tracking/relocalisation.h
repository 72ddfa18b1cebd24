// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "tracking/frame_tracking.h"
#include "tracking/map.h"
#include "tracking/place_index.h"

namespace mono3d::tracking {

// The keyframes that look most like a view, most votes first.
std::vector<PlaceMatch> LikelyPlaces(const Map& map, const PlaceIndex& places, const View& view);

// Looks for a view all over a map, by its features alone: the places that look most like it, then
// the newest keyframes. `view` gets pose and points when it works. A pose rests on 5/3 of
// `min_inliers` points or more, for a wrong place must not pass; where there is none, fewer than
// `min_inliers` are reported.
PoseResult RelocaliseInMap(Map& map, const PlaceIndex& places, View& view, int min_inliers,
                           int seed);

}  // namespace mono3d::tracking
