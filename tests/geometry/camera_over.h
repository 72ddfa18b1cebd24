// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Geometry>
#include <numbers>

#include "mono3d/geometry/pose.h"

namespace mono3d {

// x right, y down, z forward of a camera over a world with z up, by its heading (0: towards y), how
// far it looks down, and how far it rolls.
inline Pose CameraOver(const Eigen::Vector3d& centre, double heading_deg, double down_deg,
                       double roll_deg = 0) {
  constexpr double kDegree = std::numbers::pi / 180;
  Eigen::Matrix3d level;  // of one that looks along y
  level << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  const Eigen::AngleAxisd heading(-heading_deg * kDegree, Eigen::Vector3d::UnitZ());
  const Eigen::AngleAxisd pitch(-down_deg * kDegree, Eigen::Vector3d::UnitX());
  const Eigen::AngleAxisd roll(roll_deg * kDegree, Eigen::Vector3d::UnitZ());
  return {Eigen::Matrix3d(heading.toRotationMatrix() * level * pitch.toRotationMatrix() *
                          roll.toRotationMatrix()),
          centre};
}

}  // namespace mono3d
