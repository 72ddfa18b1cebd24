// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>

#include "mono3d/geometry/pose.h"
#include "synthetic/flight_options.h"

namespace mono3d::synthetic {

// The camera at `eye` that looks at `target` with a level horizon (world z is up). The line of
// sight must not be vertical; throws Error otherwise.
Pose LookAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target);

// Height of the ground in metres at a place of the horizontal plane.
using GroundHeightFunction = std::function<double(const Eigen::Vector2d& p_m)>;

// Where a camera is at each time. A value; PoseAt is thread-safe and smooth in time.
class Flight {
 public:
  // Without a ground height the ground is at 0. Throws UsageError on bad options.
  explicit Flight(const FlightOptions& options, const GroundHeightFunction& ground_height = {});

  double duration_s() const;
  // T_world_cam. Before 0 and after the duration the path stands still (the hand does not).
  Pose PoseAt(double t_s) const;

 private:
  struct Impl;
  std::shared_ptr<const Impl> impl_;
};

}  // namespace mono3d::synthetic
