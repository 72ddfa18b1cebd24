// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>

#include "calibration/camera_parameters.h"
#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/rolling_shutter.h"

namespace mono3d::calibration {

// Where a camera shows a point less where it was observed, in `sigma_px`. A pose is the rotation
// vector and the translation of T_cam_first at the middle line. The last parameters are what the
// image's angular (rad/s) and linear velocity (su/s) differ by from what is known of them.
class ReprojectionCost : public ceres::SizedCostFunction<2, kNumParameters, 6, 3, 6> {
 public:
  // `velocity` must outlive it.
  ReprojectionCost(const CameraModel& shape, const Eigen::Vector2d& pixel, double sigma_px,
                   const CameraVelocity& velocity);

  // Of the camera, the pose, the point and the velocity (row-major, each may be null). False where
  // the point lies behind the camera. By hand but for the lens: a fifth of the time of automatic
  // derivatives of the whole.
  bool Evaluate(const double* const* parameters, double* residual,
                double** jacobians) const override;

 private:
  LensModel lens_;
  Eigen::Vector2d pixel_;
  double sigma_px_;
  double row_share_;  // LineShare
  double column_share_;
  const CameraVelocity* velocity_;
};

}  // namespace mono3d::calibration
