// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <span>

#include "mono3d/geometry/pose.h"

namespace mono3d::tools {

// Where up is likely to be, as a unit vector: as FindUp finds it; else the top of the first
// camera's image, and without any camera that of a world that is the first camera's frame.
Eigen::Vector3d UpDirection(std::span<const Pose> T_world_cam,
                            std::span<const Eigen::Vector3f> normals);

}  // namespace mono3d::tools
