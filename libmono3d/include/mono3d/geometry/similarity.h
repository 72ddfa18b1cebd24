// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <span>

#include "mono3d/core/export.h"
#include "mono3d/geometry/pose.h"

namespace MONO3D_EXPORT mono3d {

// A rigid motion and a scale, an element of Sim(3): p_a = scale * (rotation * p_b) + translation.
class Similarity {
 public:
  Similarity() = default;  // identity
  // `scale` must be positive.
  Similarity(double scale, const Pose& pose) : scale_(scale), pose_(pose) {}

  double scale() const { return scale_; }
  const Pose& pose() const { return pose_; }

  Similarity Inverse() const;
  Similarity operator*(const Similarity& other) const;
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return pose_.rotation() * (scale_ * point) + pose_.translation();
  }
  // The pose of a camera that moves with the points: S_a_b * T_b_cam.
  Pose operator*(const Pose& T_b_cam) const;

 private:
  double scale_ = 1;
  Pose pose_;
};

// Least-squares S_target_source over pairs of points (Umeyama 1991). Needs as many points on both
// sides, at least three, not all in one place; throws Error otherwise.
Similarity FitSimilarity(std::span<const Eigen::Vector3d> p_source,
                         std::span<const Eigen::Vector3d> p_target);

}  // namespace mono3d
