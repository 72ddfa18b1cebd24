// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/tracking/tracker.h"
#include "tracking/map/map.h"

namespace mono3d::tracking {

// Triangulates features of a keyframe that have no point yet with those of covisible neighbours:
// search along the epipolar line, then tests of parallax, reprojection error (chi2) and scale.
// Where a point that is well known shows already, none is made, so that the map does not grow over
// ground that it has. Returns the number of new points.
int CreatePoints(Map& map, KeyframeId keyframe, const LocalMappingOptions& options);

// The same for features that are no corners in the other image: where the depths around one, as if
// on a plane, let the closest neighbour expect it, its patch is looked for there. For keyframes so
// far apart that little is common to three of them.
int CreatePointsByPatches(Map& map, KeyframeId keyframe, const LocalMappingOptions& options);

}  // namespace mono3d::tracking
