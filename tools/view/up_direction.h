// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <span>

#include "mono3d/geometry/pose.h"

namespace mono3d::tools {

// Where up is likely to be, as a unit vector: across the cameras' horizontal axes, as people and
// gimbals hold cameras level; where these leave it open, as on a straight flight, along
// `mean_normal` of the surface. The y axis of the first camera, upwards, where there is nothing.
Eigen::Vector3d UpDirection(std::span<const Pose> T_world_cam, const Eigen::Vector3d& mean_normal);

}  // namespace mono3d::tools
