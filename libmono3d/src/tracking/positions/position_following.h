// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "mono3d/image/camera_positions.h"
#include "mono3d/image/keyframe_poses.h"
#include "tracking/map/map.h"
#include "tracking/priority_mutex.h"

namespace mono3d::tracking {

// Moves the keyframes of the map, and the points with them, so that the path of the camera agrees
// with the positions as far as these are better known than how the path has drifted: long waves
// come from the positions and the known points, the local shape from the images. The first keyframe
// and the scale around it stay. `frames`: the tracked frames of the map by time, in its world. What
// was moved before counts as drift anew, so that it may be called again with more positions.
// Nothing where fewer than three positions and known points fall upon the frames, or nothing is
// found. Keyframes that were added meanwhile move along, and so do the `num_open` newest ones with
// the one before them: those that a local adjustment will still reach. It would take their shape
// back to what the images say, and that would pass for what the images had said of the path as it
// was moved. positions.S_metric_map is then as the map has become.
std::optional<PositionFit> FollowPositions(Map& map, std::span<const TrajectoryEntry> frames,
                                           std::size_t num_open, CameraPositions& positions,
                                           MappingLock& lock);

}  // namespace mono3d::tracking
