// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <optional>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"

namespace mono3d::tracking {

// The normal of a small surface, as one camera sees it, by two numbers that have no length in them:
// by how much 1 / z grows with the pixel in x and y, over 1 / z, in 1 / px of the full image (1 / z
// of a plane is linear in the pixel).
struct PatchNormal {
  Eigen::Vector2d value = Eigen::Vector2d::Zero();
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();  // the inverse of its covariance
};

// Of a surface that faces the camera: across the ray of the pixel.
Eigen::Vector2d FacingNormal(const CameraModel& camera, const Eigen::Vector2d& pixel);

// Where nothing has been seen of the surface yet: it may lean by 45 degrees to any side.
PatchNormal UnknownNormal(const CameraModel& camera, const Eigen::Vector2d& pixel);

// Can a patch on a surface of this normal be seen? Beyond 76 degrees from the ray it is taken for
// an edge.
bool IsPlausible(const CameraModel& camera, const Eigen::Vector2d& pixel,
                 const Eigen::Vector2d& normal);

// The same surface as camera b sees it: at `pixel_a` in camera a, at `pixel_b` in camera b. Nothing
// where camera b would see it from behind or hardly at all.
std::optional<PatchNormal> NormalInOther(const CameraModel& camera, const Eigen::Quaterniond& R_b_a,
                                         const Eigen::Vector2d& pixel_a,
                                         const PatchNormal& normal_a,
                                         const Eigen::Vector2d& pixel_b);

}  // namespace mono3d::tracking
