// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <optional>

#include "geo/position_fit.h"
#include "geo/position_pairs.h"
#include "mono3d/geo/georeference.h"
#include "mono3d/geo/position_track.h"

namespace mono3d {

// In standard deviations of what positions err by: what is as far off is no measurement. Of 10,000
// normal ones less than one is beyond.
inline constexpr double kFarPosition = 5;

// What is known of positions before they are looked at: by what receivers do in general, or by what
// this one states of itself.
PlacementPriors PriorsFor(const PositionTrack& track, const PositionPairs& pairs,
                          const std::optional<UpDirection>& up, const GeoreferenceOptions& options);

}  // namespace mono3d
