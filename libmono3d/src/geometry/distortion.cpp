// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/distortion.h"

namespace mono3d {

Eigen::Vector2d ProjectDistorted(const CameraModel& camera, const Eigen::Vector3d& p_cam) {
  const double x = p_cam.x() / p_cam.z();
  const double y = p_cam.y() / p_cam.z();
  const auto [k1, k2, p1, p2, k3] = camera.distortion;
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const double x_distorted = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x);
  const double y_distorted = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;
  return {camera.fx * x_distorted + camera.cx, camera.fy * y_distorted + camera.cy};
}

}  // namespace mono3d
