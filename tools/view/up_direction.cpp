// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "view/up_direction.h"

#include "mono3d/geometry/up.h"

namespace mono3d::tools {

Eigen::Vector3d UpDirection(std::span<const Pose> T_world_cam,
                            std::span<const Eigen::Vector3f> normals) {
  const Pose first = T_world_cam.empty() ? Pose() : T_world_cam.front();
  return FindUp(T_world_cam, normals).value_or(first.rotation() * -Eigen::Vector3d::UnitY());
}

}  // namespace mono3d::tools
