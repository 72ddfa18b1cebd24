// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/reprojection_cost.h"

#include <Eigen/Geometry>

#include "calibration/parameter_projection.h"
#include "calibration/projection_derivatives.h"

namespace mono3d::calibration {

ReprojectionCost::ReprojectionCost(const CameraModel& shape, const Eigen::Vector2d& pixel,
                                   double sigma_px, const CameraVelocity& velocity)
    : lens_(shape.lens),
      pixel_(pixel),
      sigma_px_(sigma_px),
      row_share_(LineShare(shape, pixel, false)),
      column_share_(LineShare(shape, pixel, true)),
      velocity_(&velocity) {}

bool ReprojectionCost::Evaluate(const double* const* parameters, double* residual,
                                double** jacobians) const {
  const double* camera = parameters[0];
  const Eigen::Map<const Eigen::Vector3d> angular_change(parameters[3]);
  const Eigen::Map<const Eigen::Vector3d> linear_change(parameters[3] + 3);
  Eigen::Map<Eigen::Vector2d> error(residual);

  const PosedPoint point(parameters[1], parameters[2]);
  // Into the camera's frame at the time of the line that the pixel is on.
  const double time_s =
      camera[kReadoutByRows] * row_share_ + camera[kReadoutByColumns] * column_share_;
  CameraVelocity v = *velocity_;
  v.angular_rad_per_s += angular_change;
  v.linear_su_per_s += linear_change;
  const Turn of_line(time_s * v.angular_rad_per_s + 0.5 * time_s * time_s * v.angular_rad_per_s2);
  const Eigen::Vector3d turned = of_line.R * point.p_cam();
  const Eigen::Vector3d p_line =
      turned + time_s * v.linear_su_per_s + 0.5 * time_s * time_s * v.linear_su_per_s2;
  if (!(p_line.z() > 0)) return false;
  if (jacobians == nullptr) {
    Eigen::Vector2d found;
    ProjectParameters(lens_, camera, p_line.data(), found.data());
    error = (found - pixel_) / sigma_px_;
    return true;
  }

  const LensPixel found(lens_, camera, p_line);
  error = (found.pixel - pixel_) / sigma_px_;
  const Eigen::Matrix<double, 2, 3> by_line = found.by_point / sigma_px_;
  const Eigen::Matrix<double, 2, 3> by_cam = by_line * of_line.R;
  if (jacobians[0] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 2, kNumParameters, Eigen::RowMajor>> by_camera(jacobians[0]);
    const Eigen::Vector3d angular =
        of_line.left * (v.angular_rad_per_s + time_s * v.angular_rad_per_s2);
    const Eigen::Vector2d by_time =
        by_line * (angular.cross(turned) + v.linear_su_per_s + time_s * v.linear_su_per_s2);
    by_camera.leftCols<LensPixel::kNumOfLens>() = found.by_lens / sigma_px_;
    by_camera.col(kReadoutByRows) = row_share_ * by_time;
    by_camera.col(kReadoutByColumns) = column_share_ * by_time;
  }
  point.WriteDerivatives(by_cam, jacobians[1], jacobians[2]);
  if (jacobians[3] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 2, 6, Eigen::RowMajor>> by_velocity(jacobians[3]);
    by_velocity.leftCols<3>() = -time_s * by_line * CrossMatrix(turned) * of_line.left;
    by_velocity.rightCols<3>() = time_s * by_line;
  }
  return true;
}

}  // namespace mono3d::calibration
