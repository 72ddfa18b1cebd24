// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

// A rigid motion, an element of SE(3). `T_a_b` maps points of frame b into frame a:
// p_a = T_a_b * p_b.
class Pose {
 public:
  Pose() = default;  // identity
  // `rotation` is normalised here; a matrix that is no rotation throws Error.
  Pose(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation);
  Pose(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation);
  // Of a rotation that was one of a Pose: taken over to the bit, not normalised once more.
  static Pose OfUnitRotation(const Eigen::Quaterniond& rotation,
                             const Eigen::Vector3d& translation) {
    Pose pose;
    pose.rotation_ = rotation;
    pose.translation_ = translation;
    return pose;
  }

  const Eigen::Quaterniond& rotation() const { return rotation_; }
  const Eigen::Vector3d& translation() const { return translation_; }

  Pose Inverse() const;
  Eigen::Matrix4d Matrix() const;
  double RotationAngle() const;  // rad, 0 to pi

  Pose operator*(const Pose& other) const;
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return rotation_ * point + translation_;
  }

 private:
  Eigen::Quaterniond rotation_ = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation_ = Eigen::Vector3d::Zero();
};

// Rotation by the vector `omega` (axis times angle in rad): the exponential map of SO(3).
Eigen::Quaterniond RotationExp(const Eigen::Vector3d& omega);
// Inverse of RotationExp; the angle is in 0 to pi.
Eigen::Vector3d RotationLog(const Eigen::Quaterniond& rotation);

}  // namespace mono3d
