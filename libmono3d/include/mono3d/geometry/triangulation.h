// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <optional>

#include "mono3d/core/export.h"
#include "mono3d/geometry/pose.h"

namespace MONO3D_EXPORT mono3d {

// The point in frame a that two cameras see along `ray_a` and `ray_b` (at z = 1, see
// CameraModel::Unproject), by the linear method of Hartley and Zisserman 2004, section 12.2.
// Nothing when the rays meet at infinity or the point is not in front of both cameras.
std::optional<Eigen::Vector3d> Triangulate(const Eigen::Vector3d& ray_a,
                                           const Eigen::Vector3d& ray_b, const Pose& T_b_a);

// Cosine of the angle at `point` between the directions to two camera centres, all in one frame.
double CosParallax(const Eigen::Vector3d& point, const Eigen::Vector3d& centre_a,
                   const Eigen::Vector3d& centre_b);

}  // namespace mono3d
