// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <optional>
#include <vector>

#include "mono3d/image/camera_positions.h"
#include "tracking/map/map.h"

namespace mono3d::tracking {

// How far each of these keyframes, living and in the order of flight, is off from the one before,
// as an adjustment of the points that they see leaves it, by the residuals of these: the median
// over stretches of the path (RelativePathSigma). Points that are seen again count: on later laps
// they alone tie keyframes. Nothing where the path is too short or its points leave it open.
std::optional<PathDrift> ImageDrift(const Map& map, const std::vector<KeyframeId>& keyframes);

}  // namespace mono3d::tracking
