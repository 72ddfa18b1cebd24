// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>

#include "calibration/camera_parameters.h"
#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/rolling_shutter.h"

namespace mono3d::calibration {

// How fast a point moves in the image as taken, at its middle line, less what is known of that
// (px/s), in `sigma_px_per_s`. The parameters are those of ReprojectionCost.
class FlowCost : public ceres::SizedCostFunction<2, kNumParameters, 6, 3, 6> {
 public:
  // `velocity` must outlive it.
  FlowCost(LensModel lens, const Eigen::Vector2d& flow_px_per_s, double sigma_px_per_s,
           const CameraVelocity& velocity);

  // As that of ReprojectionCost.
  bool Evaluate(const double* const* parameters, double* residual,
                double** jacobians) const override;

 private:
  LensModel lens_;
  Eigen::Vector2d flow_px_per_s_;
  double sigma_px_per_s_;
  const CameraVelocity* velocity_;
};

}  // namespace mono3d::calibration
