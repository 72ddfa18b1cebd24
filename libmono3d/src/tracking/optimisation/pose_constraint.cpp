// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/optimisation/pose_constraint.h"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "tracking/optimisation/chi2.h"

namespace mono3d::tracking {
namespace {

Eigen::Matrix3d Cross(const Eigen::Vector3d& v) {
  Eigen::Matrix3d cross;
  cross << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return cross;
}

// Log(Exp(omega) Exp(phi)) = phi + this * omega, for small omega.
Eigen::Matrix3d InverseLeftJacobian(const Eigen::Vector3d& phi) {
  const double angle = phi.norm();
  const Eigen::Matrix3d cross = Cross(phi);
  // Of both forms of the last factor the series is exact to the last digit up to here.
  constexpr double kSmall = 1e-3;
  const double factor =
      angle < kSmall ? 1.0 / 12 + angle * angle / 720
                     : 1 / (angle * angle) - (1 + std::cos(angle)) / (2 * angle * std::sin(angle));
  return Eigen::Matrix3d::Identity() - 0.5 * cross + factor * cross * cross;
}

}  // namespace

Vector6d PoseDeviation(const Pose& T_actual, const Pose& T_measured) {
  const Pose E = T_actual * T_measured.Inverse();
  Vector6d deviation;
  deviation << RotationLog(E.rotation()), E.translation();
  return deviation;
}

Vector6d WhitenedError(const PoseConstraint& constraint, const Pose& T_view_world,
                       const Pose& T_anchor_world) {
  return constraint.root_information *
         PoseDeviation(T_view_world * T_anchor_world.Inverse(), constraint.T_view_anchor);
}

ConstraintDerivatives Derive(const PoseConstraint& constraint, const Pose& T_view_world,
                             const Pose& T_anchor_world) {
  const Pose T_actual = T_view_world * T_anchor_world.Inverse();
  const Vector6d deviation = PoseDeviation(T_actual, constraint.T_view_anchor);
  const Eigen::Matrix3d R = T_actual.rotation().toRotationMatrix();
  const Eigen::Vector3d measured =
      RotationExp(deviation.head<3>()) * constraint.T_view_anchor.translation();
  const Eigen::Matrix3d inverse_jacobian = InverseLeftJacobian(deviation.head<3>());
  const Eigen::Vector3d& t_anchor = T_anchor_world.translation();
  Matrix6d by_view = Matrix6d::Zero();
  by_view.topLeftCorner<3, 3>() = inverse_jacobian;
  by_view.bottomLeftCorner<3, 3>() = Cross(R * t_anchor + measured);
  by_view.bottomRightCorner<3, 3>().setIdentity();
  Matrix6d by_anchor = Matrix6d::Zero();
  by_anchor.topLeftCorner<3, 3>() = -inverse_jacobian * R;
  by_anchor.bottomLeftCorner<3, 3>() = -R * Cross(t_anchor) - Cross(measured) * R;
  by_anchor.bottomRightCorner<3, 3>() = -R;
  const Matrix6d& root = constraint.root_information;
  return {root * deviation, root * by_view, root * by_anchor};
}

double ConstraintCost(double chi2) { return kChi2SixDof * std::log1p(chi2 / kChi2SixDof); }

double ConstraintWeight(double chi2) { return 1 / (1 + chi2 / kChi2SixDof); }

Eigen::MatrixXd RootOf(const Eigen::MatrixXd& information) {
  Eigen::VectorXd unit = information.diagonal().cwiseMax(0.0).cwiseSqrt();
  const Eigen::VectorXd inverse =
      unit.unaryExpr([](double value) { return value > 0 ? 1 / value : 0; });
  const Eigen::MatrixXd scaled = inverse.asDiagonal() * information * inverse.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(scaled);
  return solver.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal() *
         solver.eigenvectors().transpose() * unit.asDiagonal();
}

Matrix6d PoseInformation(const Matrix7d& information) {
  Matrix6d of_pose = information.topLeftCorner<6, 6>();
  const double of_scale = information(6, 6);
  if (!(of_scale > 0)) return of_pose;
  const Vector6d mixed = information.topRightCorner<6, 1>();
  return of_pose - mixed * mixed.transpose() / of_scale;
}

}  // namespace mono3d::tracking
