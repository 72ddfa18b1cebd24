// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/geometry/pose.h"

namespace MONO3D_EXPORT mono3d {

// The same scene point in two images, in pixels or at z = 1.
struct PointPair {
  Eigen::Vector2d a;
  Eigen::Vector2d b;
};

// Moves points so that their centroid is the origin and their mean distance from it sqrt(2)
// (Hartley 1997). Returns the 3x3 matrix of the motion; identity scale where all points coincide.
Eigen::Matrix3d NormalisingTransform(std::span<const PointPair> pairs,
                                     Eigen::Vector2d PointPair::*side);

// H with b ~ H * a, by the normalised direct linear transform over four pairs or more. Nothing when
// the pairs do not determine it.
std::optional<Eigen::Matrix3d> FitHomography(std::span<const PointPair> pairs);

// A motion seen over a plane.
struct PlaneMotion {
  Pose T_b_a;                // the translation in units of the distance of camera a to the plane
  Eigen::Vector3d normal_a;  // unit length: the points p_a of the plane have normal_a . p_a = 1
};

// The two motions that explain a homography between calibrated cameras, p_b ~ H * p_a at z = 1,
// over a plane in front of camera a that both see from the same side (Ma, Soatto, Kosecka, Sastry
// 2004, section 5.3). None when H is (almost) a rotation and shows no translation.
std::vector<PlaneMotion> DecomposeHomography(const Eigen::Matrix3d& H);

}  // namespace mono3d
