// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <optional>
#include <span>
#include <vector>

#include "mono3d/image/camera_positions.h"
#include "tracking/map/map.h"
#include "tracking/optimisation/bundle_adjustment_problem.h"

namespace mono3d::tracking {

// What is needed of the map to tell how it drifts: some stretches of its path with their points.
// `keyframes`: living, in the order of flight. Empty where the path is too short.
std::vector<BundleAdjustmentProblem> StretchesOf(const Map& map,
                                                 const std::vector<KeyframeId>& keyframes);

// How far each keyframe is off from the one before, as an adjustment of the points that they see
// leaves it, by the residuals of these: the median over the stretches (RelativePathSigma). Points
// that are seen again count: on later laps they alone tie keyframes. Nothing where the points leave
// all stretches open. Takes about a tenth of a second.
std::optional<PathDrift> ImageDrift(std::span<const BundleAdjustmentProblem> stretches);

}  // namespace mono3d::tracking
