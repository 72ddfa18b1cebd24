// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>

#include "mono3d/core/export.h"
#include "mono3d/geometry/homography.h"
#include "mono3d/geometry/pose.h"

namespace MONO3D_EXPORT mono3d {

// F of rank 2 with b^T F a = 0, by the normalised eight-point method (Hartley 1997) over eight
// pairs or more. Nothing when the pairs do not determine it (all on a plane, for one).
std::optional<Eigen::Matrix3d> FitFundamental(std::span<const PointPair> pairs);

// F between pixels for two pinhole cameras of the matrices K_a and K_b.
Eigen::Matrix3d FundamentalFromMotion(const Pose& T_b_a, const Eigen::Matrix3d& K_a,
                                      const Eigen::Matrix3d& K_b);

// The four motions of an essential matrix, translation of unit length (Hartley and Zisserman 2004,
// section 9.6.2). One of them has the points in front of both cameras.
std::array<Pose, 4> DecomposeEssential(const Eigen::Matrix3d& E);

// Squared distance in px of `b` from the epipolar line F a.
double SquaredEpipolarDistance(const Eigen::Matrix3d& F, const Eigen::Vector2d& a,
                               const Eigen::Vector2d& b);

}  // namespace mono3d
