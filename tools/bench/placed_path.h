// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <span>

#include "mono3d/geometry/stamped_pose.h"

namespace mono3d::tools {

// What a path that was placed on the earth is off by, in metres where nothing else is said.
struct PlacedPathError {
  double log_scale = 0;
  double heading_rad = 0;                              // about the vertical, left positive
  Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();  // mean over the poses
  double rms_m = 0;                                    // of the camera centres as they are
  // After the best similarity of all of it: the largest distance.
  double largest_m = 0;
  // After the best similarity of each stretch of so many metres: root of the mean square.
  double local_m = 0;
  double length_m = 0;  // of the true path
};

// `placed` and `truth` in the same axes, with z up. Poses are compared that are of one time, to a
// millisecond. Throws Error where there are fewer than three.
PlacedPathError ComparePlacedPath(std::span<const StampedPose> placed,
                                  std::span<const StampedPose> truth, double stretch_m);

}  // namespace mono3d::tools
