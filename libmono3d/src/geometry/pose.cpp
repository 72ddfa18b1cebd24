// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/pose.h"

#include <cmath>
#include <sstream>
#include <string>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

Eigen::Quaterniond ToQuaternion(const Eigen::Matrix3d& rotation) {
  constexpr double kRounding = 1e-6;
  const double error = (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).norm();
  if (error <= kRounding && rotation.determinant() > 0) return Eigen::Quaterniond(rotation);
  std::ostringstream found;  // NaN comes here as well
  found << "R^T R - I of norm " << error << ", determinant " << rotation.determinant();
  throw Error(ErrorParts{.what = "matrix is no rotation",
                         .where = {},
                         .expected = "an orthonormal matrix of determinant 1",
                         .found = found.str()});
}

}  // namespace

Pose::Pose(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation)
    : rotation_(rotation.normalized()), translation_(translation) {}

Pose::Pose(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation)
    : Pose(ToQuaternion(rotation), translation) {}

Pose Pose::Exactly(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation) {
  constexpr double kRounding = 1e-9;
  const double error = std::abs(rotation.squaredNorm() - 1);
  if (!(error <= kRounding)) {
    throw Error(ErrorParts{.what = "quaternion is no rotation",
                           .where = {},
                           .expected = "unit length",
                           .found = "a square " + std::to_string(error) + " away from 1"});
  }
  Pose pose;
  pose.rotation_ = rotation;
  pose.translation_ = translation;
  return pose;
}

Pose Pose::Inverse() const {
  const Eigen::Quaterniond inverse = rotation_.conjugate();
  return {inverse, inverse * -translation_};
}

Eigen::Matrix4d Pose::Matrix() const {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() = rotation_.toRotationMatrix();
  matrix.topRightCorner<3, 1>() = translation_;
  return matrix;
}

double Pose::RotationAngle() const { return RotationLog(rotation_).norm(); }

Pose Pose::operator*(const Pose& other) const {
  return {rotation_ * other.rotation_, rotation_ * other.translation_ + translation_};
}

Eigen::Quaterniond RotationExp(const Eigen::Vector3d& omega) {
  const double half = 0.5 * omega.norm();
  // sin(x)/x by its series where the quotient loses digits.
  const double scale = half < 1e-4 ? 0.5 * (1 - half * half / 6) : 0.5 * std::sin(half) / half;
  const Eigen::Vector3d imaginary = scale * omega;
  return Eigen::Quaterniond(std::cos(half), imaginary.x(), imaginary.y(), imaginary.z())
      .normalized();
}

Eigen::Vector3d RotationLog(const Eigen::Quaterniond& rotation) {
  Eigen::Quaterniond q = rotation.normalized();
  if (q.w() < 0) q.coeffs() = -q.coeffs();  // the shorter way round
  const double sine = q.vec().norm();
  if (sine < 1e-12) return 2 * q.vec();
  return (2 * std::atan2(sine, q.w()) / sine) * q.vec();
}

}  // namespace mono3d
