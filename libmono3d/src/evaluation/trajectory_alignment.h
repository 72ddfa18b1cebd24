// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <span>

#include "mono3d/geometry/pose.h"
#include "mono3d/geometry/similarity.h"

namespace mono3d {

struct TrajectoryAlignment {
  Similarity S_truth_estimate;
  bool is_straight = false;  // see TrajectoryError
};

// Least-squares alignment of the positions, of camera i on both sides, with scale or with scale 1.
// Throws Error when there are fewer than three or when all positions of a side are in one place.
TrajectoryAlignment AlignTrajectory(std::span<const Pose> estimate, std::span<const Pose> truth,
                                    bool with_scale);

}  // namespace mono3d
