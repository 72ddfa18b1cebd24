// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/photos/mirrored_pose.h"

#include <Eigen/Eigenvalues>

namespace mono3d::tracking {

Pose MirroredPose(const Pose& T_cam_world, std::span<const Eigen::Vector3d> p_world) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : p_world) middle += p / static_cast<double>(p_world.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : p_world) scatter += (p - middle) * (p - middle).transpose();
  const Eigen::Vector3d normal =
      T_cam_world.rotation() *
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors().col(0);
  const Eigen::Vector3d p_cam = T_cam_world * middle;
  const Eigen::Vector3d sight = p_cam.normalized();
  // Depths along the sight change their signs; the mirror in the plane, which leaves it as it is,
  // makes a rotation of that.
  const Eigen::Matrix3d turn = (Eigen::Matrix3d::Identity() - 2 * sight * sight.transpose()) *
                               (Eigen::Matrix3d::Identity() - 2 * normal * normal.transpose());
  return Pose(Eigen::Quaterniond(turn), p_cam - turn * p_cam) * T_cam_world;
}

}  // namespace mono3d::tracking
