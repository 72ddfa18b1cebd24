// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "geometry/smooth_path.h"

#include <algorithm>
#include <cstddef>
#include <iterator>

namespace mono3d {
namespace {

using Eigen::Vector3d;

Vector3d Slope(const TimedPoint& a, const TimedPoint& b) {
  return (b.p - a.p) / (b.time_s - a.time_s);
}

// Of the parabola: the nearer neighbour counts more, so that a gap beside the point does not.
Vector3d VelocityAt(std::span<const TimedPoint> path, std::size_t i) {
  if (i == 0) return Slope(path[0], path[1]);
  if (i + 1 == path.size()) return Slope(path[i - 1], path[i]);
  const double before_s = path[i].time_s - path[i - 1].time_s;
  const double after_s = path[i + 1].time_s - path[i].time_s;
  return (after_s * Slope(path[i - 1], path[i]) + before_s * Slope(path[i], path[i + 1])) /
         (before_s + after_s);
}

}  // namespace

PathPoint PointOnPath(std::span<const TimedPoint> path, double time_s) {
  const auto found = std::ranges::lower_bound(path, time_s, {}, &TimedPoint::time_s);
  const auto after = static_cast<std::size_t>(
      std::clamp<std::ptrdiff_t>(found - path.begin(), 1, std::ssize(path) - 1));
  const TimedPoint& a = path[after - 1];
  const TimedPoint& b = path[after];
  const double step_s = b.time_s - a.time_s;
  const double u = std::clamp((time_s - a.time_s) / step_s, 0.0, 1.0);
  const Vector3d v_a = step_s * VelocityAt(path, after - 1);
  const Vector3d v_b = step_s * VelocityAt(path, after);
  const Vector3d c2 = 3 * (b.p - a.p) - 2 * v_a - v_b;
  const Vector3d c3 = 2 * (a.p - b.p) + v_a + v_b;
  return {a.p + u * (v_a + u * (c2 + u * c3)), (v_a + u * (2 * c2 + 3 * u * c3)) / step_s};
}

}  // namespace mono3d
