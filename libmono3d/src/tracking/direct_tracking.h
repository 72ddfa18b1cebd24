// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <optional>

#include "tracking/frame_tracking.h"
#include "tracking/map.h"

namespace mono3d::tracking {

// Takes the patch of a point from a keyframe that sees it with `feature`: how the point looks from
// now on. What is known of its surface's slope stays. False where the keyframe has no images any
// more or the patch would leave them.
bool TakePatchOf(Map& map, PointId point, KeyframeId keyframe, const Feature& feature);

// Does a camera at `centre` see the point as keyframe `from` did: from less than 10 degrees aside,
// and at about the same scale?
bool LooksAlike(const Map& map, const MapPoint& point, KeyframeId from,
                const Eigen::Vector3d& centre);

// Where `view`, at its pose, shows a map point: found by its patch from `start_px`. The feature
// has no descriptor yet. Nothing when the point has no patch or it is not to be seen there.
std::optional<Feature> FindPatch(const Map& map, PointId point, const View& view,
                                 const Eigen::Vector2d& start_px);

// What a new keyframe shows of how the surfaces lie that its points are on: taken for facing the
// camera of their patch, they would be found off by the more the further one has flown.
void LearnSlopes(Map& map, KeyframeId keyframe);

// Follows the previous view without features: aligns the images (sparse image alignment), then each
// point by its patch, then refines the pose over all of them (Forster, Pizzoli, Scaramuzza 2014).
// `view.T_cam_world` is the prediction. The view's features become the points found.
PoseResult TrackDirectly(Map& map, const View& previous, View& view);

// The last two steps of it from a pose that is good to some pixels. `near`: the view whose points'
// keyframes are searched. Counts for each point tried whether it was found.
PoseResult TrackPatches(Map& map, const View& near, View& view);

// How many of the view's points a view at the same place would be tracked by: those that three
// keyframes see, one for each cell of the image.
int CountTrackable(const Map& map, const View& view);

// How many points of the previous view the view should show at its pose, one for each cell of the
// image.
int CountExpected(const Map& map, const View& previous, const View& view);

}  // namespace mono3d::tracking
