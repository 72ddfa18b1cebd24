// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "tracking/map/map.h"
#include "tracking/start/map_initialiser.h"

namespace mono3d::tracking {

// Fills an empty map with the keyframes and points of a start: the points found to a fraction of a
// pixel, all adjusted, with median depth 1.
void FillMap(const MapStart& start, Map& map);

}  // namespace mono3d::tracking
