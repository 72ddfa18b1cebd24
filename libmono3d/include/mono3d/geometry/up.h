// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "mono3d/core/export.h"
#include "mono3d/geometry/pose.h"

namespace MONO3D_EXPORT mono3d {

// The directions in a camera that are right and down in its image.
struct ImageDirections {
  Eigen::Vector3d right;
  Eigen::Vector3d down;

  // In the image as it is shown: turned clockwise by `turn_deg`.
  static ImageDirections Shown(int turn_deg);
};

// Which way is up in a world, as a unit vector: not measured, but found as the direction
// - to which the cameras' right axes are perpendicular: cameras are held, or hung, level;
// - to which the steps between the cameras are perpendicular, or else parallel: flights are mostly
//   level ones, and drones rise and sink;
// - in which more of the surface faces than in others: ground and roofs;
// among those in which no camera is upside down or looks steeply up. Where the cameras turn, the
// first of these decides. Nothing of fewer than three cameras, which are in the order of their
// images, or where no direction is possible. `normals`: of the surface; some 1,500 of them are
// asked. `turn_deg`: ReadShownTurn of the images, which are not turned themselves.
std::optional<Eigen::Vector3d> FindUp(std::span<const Pose> T_world_cam,
                                      std::span<const Eigen::Vector3f> normals, int turn_deg = 0);

}  // namespace mono3d
