// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/flow_cost.h"

#include <Eigen/Geometry>

#include "calibration/projection_derivatives.h"

namespace mono3d::calibration {

FlowCost::FlowCost(LensModel lens, const Eigen::Vector2d& flow_px_per_s, double sigma_px_per_s,
                   const CameraVelocity& velocity)
    : lens_(lens),
      flow_px_per_s_(flow_px_per_s),
      sigma_px_per_s_(sigma_px_per_s),
      velocity_(&velocity) {}

// By the pixels a moment before and after: of these the derivatives are known.
bool FlowCost::Evaluate(const double* const* parameters, double* residual,
                        double** jacobians) const {
  constexpr double kMoment_s = 0.0005;  // in which no point moves by more than some px
  const double* camera = parameters[0];
  const Eigen::Map<const Eigen::Vector3d> angular_change(parameters[3]);
  const Eigen::Map<const Eigen::Vector3d> linear_change(parameters[3] + 3);
  Eigen::Map<Eigen::Vector2d> error(residual);

  const PosedPoint point(parameters[1], parameters[2]);
  const Eigen::Vector3d& p_cam = point.p_cam();
  const Eigen::Vector3d angular = velocity_->angular_rad_per_s + angular_change;
  const Eigen::Vector3d linear = velocity_->linear_su_per_s + linear_change;
  const Eigen::Vector3d moved = kMoment_s * (angular.cross(p_cam) + linear);
  const Eigen::Vector3d p_before = p_cam - moved;
  const Eigen::Vector3d p_after = p_cam + moved;
  if (!(p_before.z() > 0 && p_after.z() > 0)) return false;
  const LensPixel before(lens_, camera, p_before);
  const LensPixel after(lens_, camera, p_after);
  const double per_s = 1 / (2 * kMoment_s);
  error = (per_s * (after.pixel - before.pixel) - flow_px_per_s_) / sigma_px_per_s_;
  if (jacobians == nullptr) return true;

  const double scale = per_s / sigma_px_per_s_;
  const Eigen::Matrix<double, 2, 3> by_moved = scale * (after.by_point + before.by_point);
  const Eigen::Matrix<double, 2, 3> by_cam =
      scale * (after.by_point - before.by_point) + kMoment_s * by_moved * CrossMatrix(angular);
  if (jacobians[0] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 2, kNumParameters, Eigen::RowMajor>> by_camera(jacobians[0]);
    by_camera.setZero();
    by_camera.leftCols<LensPixel::kNumOfLens>() = scale * (after.by_lens - before.by_lens);
  }
  point.WriteDerivatives(by_cam, jacobians[1], jacobians[2]);
  if (jacobians[3] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 2, 6, Eigen::RowMajor>> by_velocity(jacobians[3]);
    by_velocity.leftCols<3>() = -kMoment_s * by_moved * CrossMatrix(p_cam);
    by_velocity.rightCols<3>() = kMoment_s * by_moved;
  }
  return true;
}

}  // namespace mono3d::calibration
