// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/flight.h"

#include <Eigen/Geometry>

#include "mono3d/core/error.h"

namespace mono3d::synthetic {

Pose LookAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target) {
  const Eigen::Vector3d forward = (target - eye).normalized();
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ());
  constexpr double kVertical = 1e-6;  // sine of the angle to the vertical
  if (!(right.norm() > kVertical)) throw Error("a camera that looks straight down has no horizon");
  Eigen::Matrix3d R_world_cam;
  R_world_cam.col(0) = right.normalized();
  R_world_cam.col(1) = forward.cross(right.normalized());
  R_world_cam.col(2) = forward;
  return Pose(R_world_cam, eye);
}

}  // namespace mono3d::synthetic
