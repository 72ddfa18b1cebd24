// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "mono3d/core/export.h"
#include "mono3d/geometry/pose.h"

namespace MONO3D_EXPORT mono3d {

// Where a keyframe is to another one, by something else than the tracker's points: a depth map of
// it that was registered with a part of the model that came from the other one. Lengths are in the
// keyframes' own units.
struct KeyframeConstraint {
  std::int64_t id = 0;         // of the keyframe
  std::int64_t anchor_id = 0;  // of the one from which that part of the model came
  Pose T_cam_anchor;           // from the anchor's camera into the keyframe's, in the anchor's unit
  double scale = 1;            // by it lengths around the keyframe become such around the anchor
  // Inverse covariance of rotation (rad), translation (the anchor's unit) and logarithm of the
  // scale: the true pose is Exp(error) * T_cam_anchor, the true scale exp(error) * scale.
  // Directions that nothing tells of have 0.
  Eigen::Matrix<double, 7, 7> information = Eigen::Matrix<double, 7, 7>::Zero();
};

}  // namespace mono3d
