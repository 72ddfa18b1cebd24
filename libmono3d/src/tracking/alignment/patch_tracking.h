// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "tracking/map/map.h"
#include "tracking/optimisation/view_pose.h"

namespace mono3d::tracking {

// Points in view below which images are so far apart that little is common to three of them.
inline constexpr std::size_t kFewPoints = 100;

// Follows the previous view without features: aligns the images (sparse image alignment), then each
// point by its patch, then refines the pose over all of them (Forster, Pizzoli, Scaramuzza 2014).
// `view.T_cam_world` is the prediction. The view's features become the points found.
PoseResult TrackDirectly(Map& map, const View& previous, View& view);

// The last two steps of it from a pose that is good to some pixels. `near`: the view whose points'
// keyframes are searched, and whose `patch_noise` the view's begins with. It follows one point of
// each cell of the image, and more where these are few. Measures `view.patch_noise`, by which the
// standard deviations of the view's features are multiplied, and counts for each point tried
// whether it was found.
PoseResult TrackPatches(Map& map, const View& near, View& view);

// How many points the view is tracked by, one for each cell of the image.
int CountTracked(const Map& map, const View& view);

// How many of the view's points a view at the same place would be tracked by: those that three
// keyframes see, one for each cell of the image.
int CountTrackable(const Map& map, const View& view);

// How many points of the previous view the view should show at its pose, one for each cell of the
// image.
int CountExpected(const Map& map, const View& previous, const View& view);

}  // namespace mono3d::tracking
