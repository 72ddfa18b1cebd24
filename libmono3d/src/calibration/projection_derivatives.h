// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>

#include "calibration/camera_parameters.h"
#include "mono3d/geometry/camera_model.h"

namespace mono3d::calibration {

// The matrix whose product with a vector is the cross product of `v` with it.
Eigen::Matrix3d CrossMatrix(const Eigen::Vector3d& v);

// A rotation vector's rotation matrix R, and its left Jacobian: the vector that turns R as a change
// of the rotation vector does is the Jacobian times that change.
struct Turn {
  Eigen::Matrix3d R;
  Eigen::Matrix3d left;

  explicit Turn(const Eigen::Vector3d& rotation);
};

// A point in a camera's frame. A pose is the rotation vector and the translation of T_cam_first.
class PosedPoint {
 public:
  PosedPoint(const double* pose, const double* p_first);

  const Eigen::Vector3d& p_cam() const { return p_cam_; }
  // Of what changes by `by_cam` with the point in the camera's frame: by the pose and by the point
  // (row-major, each may be null).
  void WriteDerivatives(const Eigen::Matrix<double, 2, 3>& by_cam, double* by_pose,
                        double* by_point) const;

 private:
  Turn turn_;
  Eigen::Vector3d rotated_;
  Eigen::Vector3d p_cam_;
};

// Where the lens shows a point (z forward must be positive), with the derivatives by the point and
// by the lens: all parameters of a camera but the readout times, which come last.
struct LensPixel {
  static constexpr int kNumOfLens = kReadoutByRows;

  Eigen::Vector2d pixel;
  Eigen::Matrix<double, 2, 3> by_point;
  Eigen::Matrix<double, 2, kNumOfLens> by_lens;

  LensPixel(LensModel lens, const double* camera, const Eigen::Vector3d& p_cam);
};

}  // namespace mono3d::calibration
