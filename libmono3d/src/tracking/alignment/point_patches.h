// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <optional>

#include "tracking/map/map.h"

namespace mono3d::tracking {

// Takes the patch of a point from a keyframe that sees it with `feature`: how the point looks from
// now on. What is known of its surface's normal stays. False where the keyframe has no images any
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

// Updates the patch normals of the points that a new keyframe sees. A patch that is taken for
// facing its camera is found at a wrong pixel, the more so the further the camera has moved.
void EstimatePatchNormals(Map& map, KeyframeId keyframe);

// Points that the keyframe sees otherwise than the keyframe of their patch did (LooksAlike) get a
// new patch from it.
void RenewPatches(Map& map, KeyframeId keyframe);

}  // namespace mono3d::tracking
