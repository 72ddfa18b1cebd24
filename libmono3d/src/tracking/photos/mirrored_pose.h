// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <span>

#include "mono3d/geometry/pose.h"

namespace mono3d::tracking {

// From afar, points on a plane look nearly alike from two poses: the plane leans to one side of the
// line of sight or as much to the other (Schweighofer, Pinz 2006). The other one of T_cam_world, a
// start for an adjustment; of points straight in front it is the same. At least three points.
Pose MirroredPose(const Pose& T_cam_world, std::span<const Eigen::Vector3d> p_world);

}  // namespace mono3d::tracking
