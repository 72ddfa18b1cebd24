// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/tracking/tracker.h"
#include "tracking/map/map.h"

namespace mono3d::tracking {

// Triangulates features of a keyframe that have no point yet with those of covisible neighbours:
// search along the epipolar line, then tests of parallax, reprojection error (chi2) and scale.
// None is made where a well known point shows already, so that the map does not grow over ground
// that it covers. Returns the number of new points.
int CreatePoints(Map& map, KeyframeId keyframe, const LocalMappingOptions& options);

// The same for features that are no corners in the other image: the depths of the points around a
// feature predict, as if on a plane, where the closest neighbour shows it, and its patch is
// searched there. For keyframes so far apart that little is common to three of them.
int CreatePointsByPatches(Map& map, KeyframeId keyframe, const LocalMappingOptions& options);

}  // namespace mono3d::tracking
