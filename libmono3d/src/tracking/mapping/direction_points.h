// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "tracking/map/map.h"

namespace mono3d::tracking {

// Where a keyframe has come about by turning on the spot, what has come into view has no second
// view to be triangulated with. There, features of cells without any point become directions (see
// depth_uncertainty.h): at the depth that a plane through the inverse depths of the other points
// has. None is made where a keyframe with a baseline looks as well. Returns the number of new
// points.
int CreateDirectionPoints(Map& map, KeyframeId keyframe);

}  // namespace mono3d::tracking
