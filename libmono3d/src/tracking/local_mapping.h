// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "mono3d/core/timing.h"
#include "mono3d/image/keyframe.h"
#include "mono3d/tracking/tracker.h"
#include "tracking/map.h"
#include "tracking/map_turn.h"

namespace mono3d::tracking {

// All that happens once for each new keyframe: new points, fusion, culling, local bundle
// adjustment.
// The turn is given up between the steps and while the adjustment works on its copy.
void MapKeyframeInto(Map& map, KeyframeId keyframe, const LocalMappingOptions& options,
                     StageTimes* times, MappingTurn& turn);

// Bundle adjustment of a keyframe with its most covisible ones; older ones that see the same points
// stay where they are. Outliers lose their observation. Keyframes that came meanwhile move along.
void AdjustLocally(Map& map, KeyframeId keyframe, const LocalMappingOptions& options,
                   MappingTurn& turn);

// Bundle adjustment of everything; only the first keyframe stays. With a turn: false when it was
// interrupted; what it had found by then is in the map.
void AdjustAll(Map& map);
bool AdjustAll(Map& map, MappingTurn& turn);

// Takes away the observations that do not fit the map as it is.
void RemoveOutliers(Map& map);

// Points that the keyframe sees otherwise than their patch shows them, from more than 10 degrees
// aside or at another scale, get their patch from it.
void RenewPatches(Map& map, KeyframeId keyframe);

// Settled keyframes of which most points are seen by three others go.
void CullKeyframes(Map& map, KeyframeId keyframe, const LocalMappingOptions& options);

// The keyframes of a map, also the culled ones, by time: those from before a start came later.
std::vector<KeyframeId> InOrderOfFlight(const Map& map);

// Hands out the keyframes that are final, in the order of flight: those that shared a bundle
// adjustment with two newer ones. `all`: every one left. Their images are released here.
std::vector<Keyframe> TakeFinalised(Map& map, bool all);

// Counts a keyframe as adjusted with newer ones as often as it takes to settle.
void MarkAdjusted(Map& map, KeyframeId keyframe);

}  // namespace mono3d::tracking
