// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <optional>

#include "mono3d/image/camera_positions.h"
#include "mono3d/image/sparse_model.h"

namespace mono3d::tracking {

// Bundle adjustment of a map of photos, its camera held, with where the cameras were measured to be
// and with known points, each by its standard deviations. Positions have Cauchy's loss, so that
// those that are far off do not count; known points Huber's, so that a map which is bent still
// comes to them. The images' ids are the frames that positions and sights name. The first image and
// the unit of length around it stay: positions.S_metric_map is then as the map has become. Nothing,
// and nothing moves, with fewer than three positions and points, or where no solution was found.
std::optional<PositionFit> AdjustToEarth(SparseModel& model, CameraPositions& positions);

}  // namespace mono3d::tracking
