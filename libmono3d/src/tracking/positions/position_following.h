// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "mono3d/image/camera_positions.h"
#include "mono3d/image/keyframe_poses.h"
#include "tracking/map/map.h"
#include "tracking/optimisation/bundle_adjustment_problem.h"
#include "tracking/positions/path_fit.h"
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

// The same in three steps, of which the second one takes the time and does without the map:
// FindPath, FitPath, MoveOntoPath. Meanwhile its `num_open` newest keyframes may move, keyframes be
// added and given up, and nothing else.
struct PathOfMap {
  std::vector<KeyframeId> keyframes;  // of each node
  KeyframeId num_keyframes = 0;       // of the map, living or not
  std::size_t num_open = 0;
  std::vector<Similarity> S_metric_kf;             // before it was fitted
  std::vector<BundleAdjustmentProblem> stretches;  // see ImageDrift
  PositionedPath path;                             // its drift is guessed at before it is fitted
};
std::optional<PathOfMap> FindPath(const Map& map, std::span<const TrajectoryEntry> frames,
                                  std::size_t num_open, const CameraPositions& positions);
PathFit FitPath(PathOfMap& of_map);
PositionFit MoveOntoPath(const PathOfMap& of_map, const PathFit& fit, Map& map,
                         CameraPositions& positions);

}  // namespace mono3d::tracking
