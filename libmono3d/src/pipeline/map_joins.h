// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "mono3d/geometry/point_cloud.h"
#include "mono3d/geometry/similarity.h"
#include "mono3d/image/keyframe_poses.h"

namespace mono3d {

// Poses of `join.from` become such of `join.into`.
void MoveEntries(const MapJoin& join, std::vector<TrajectoryEntry>& entries);

PointCloud Moved(const Similarity& S_into_from, PointCloud cloud);

// Each list stays as long as the points, or is left empty where one of the clouds has none.
void AppendCloud(const PointCloud& more, PointCloud& cloud);

}  // namespace mono3d
