// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "mono3d/geometry/pose.h"

namespace mono3d::tracking {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector7d = Eigen::Matrix<double, 7, 1>;
using Matrix7d = Eigen::Matrix<double, 7, 7>;

// What is known of two views of a bundle besides the points that they see.
struct PoseConstraint {
  std::size_t view = 0;
  std::size_t anchor = 0;
  Pose T_view_anchor;         // as measured
  Matrix6d root_information;  // whitens an error of (rotation, translation)
};

// Of the whitened error (the actual pose is Exp(error) * T_view_anchor), by (omega, dt) of either
// view: R' = Exp(omega) R, t' = t + dt of T_cam_world.
struct ConstraintDerivatives {
  Vector6d error;
  Matrix6d by_view;
  Matrix6d by_anchor;
};

// Rotation and translation of T_actual * T_measured^-1.
Vector6d PoseDeviation(const Pose& T_actual, const Pose& T_measured);
Vector6d WhitenedError(const PoseConstraint& constraint, const Pose& T_view_world,
                       const Pose& T_anchor_world);
ConstraintDerivatives Derive(const PoseConstraint& constraint, const Pose& T_view_world,
                             const Pose& T_anchor_world);

// Cauchy's loss, beyond the limit of 95 %: a constraint that nothing else agrees with pulls less
// the more it is off. Cost, and what the square counts for at it.
double ConstraintCost(double chi2);
double ConstraintWeight(double chi2);

// W with W' W = information, which may leave directions open. Rotations and lengths have units of
// their own: decomposed over its own diagonal.
Eigen::MatrixXd RootOf(const Eigen::MatrixXd& information);
// Of the pose alone, whatever the scale is.
Matrix6d PoseInformation(const Matrix7d& information);

}  // namespace mono3d::tracking
