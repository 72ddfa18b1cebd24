// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <span>

#include "bench/position_draw.h"
#include "mono3d/geometry/stamped_pose.h"
#include "mono3d/image/camera_positions.h"

namespace mono3d::tools {

// What a placement may be off by: east, north, up of the middle of the path in m; turn about east,
// north, up in rad; logarithm of the scale; clock offset in s.
using PlacementVector = Eigen::Matrix<double, 8, 1>;
using PlacementMatrix = Eigen::Matrix<double, 8, 8>;

// What is known of it without positions: standard deviations.
struct PlacementKnowledge {
  double tilt_rad = 0;  // of each of the two angles of up
  double clock_offset_s = 0;
};

// How well the path of a camera can be placed at all by positions whose errors have a known
// covariance, the path being exact and the outliers known: generalised least squares of a
// similarity and the clock offset.
class PlacementBound {
 public:
  // By the positions of `drawn` that are no outliers. Takes O(positions^3).
  PlacementBound(std::span<const StampedPose> truth, const DrawnPositions& drawn,
                 const PositionNoise& noise, const PlacementKnowledge& knowledge);

  const PlacementMatrix& covariance() const { return covariance_; }
  // What that estimate is off by with the errors that were drawn.
  const PlacementVector& error_of_best() const { return error_of_best_; }

 private:
  PlacementMatrix covariance_;
  PlacementVector error_of_best_;
};

}  // namespace mono3d::tools
