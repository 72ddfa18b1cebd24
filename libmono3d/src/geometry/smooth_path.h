// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <span>

namespace mono3d {

struct TimedPoint {
  double time_s = 0;
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
};

// Where something is, and how fast it moves.
struct PathPoint {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
};

// Between the points of a smooth path (cubic Hermite spline; the velocity at a point is that of the
// parabola through it and its neighbours): a chord cuts a turn short, of a quarter of a second on a
// circle of 20 m by centimetres, and makes all of an orbit too small. Before the first point and
// after the last one it stays. Two points at least, whose times ascend.
PathPoint PointOnPath(std::span<const TimedPoint> path, double time_s);

}  // namespace mono3d
