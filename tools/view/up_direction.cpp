// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "view/up_direction.h"

#include <Eigen/Eigenvalues>

namespace mono3d::tools {

Eigen::Vector3d UpDirection(std::span<const Pose> T_world_cam, const Eigen::Vector3d& mean_normal) {
  if (T_world_cam.empty()) return -Eigen::Vector3d::UnitY();
  // How much the surface counts beside the cameras: less than turns by some ten degrees.
  constexpr double kWeightOfNormal = 0.05;
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Vector3d upwards = Eigen::Vector3d::Zero();
  for (const Pose& pose : T_world_cam) {
    const Eigen::Matrix3d R = pose.rotation().toRotationMatrix();
    sum += R.col(0) * R.col(0).transpose();
    upwards -= R.col(1);
  }
  const auto num = static_cast<double>(T_world_cam.size());
  sum /= num;
  sum -= kWeightOfNormal * mean_normal * mean_normal.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(sum);
  const Eigen::Vector3d up = solver.eigenvectors().col(0);
  // A camera that looks straight down says nothing of the sign; the surface that it sees does.
  const double sign = up.dot(upwards / num + mean_normal);
  return sign < 0 ? Eigen::Vector3d(-up) : up;
}

}  // namespace mono3d::tools
