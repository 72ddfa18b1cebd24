// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <vector>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"

namespace mono3d::tracking {

// A known point and where an image shows it.
struct PointMeasurement {
  Eigen::Vector3d p_world;
  Eigen::Vector2d pixel;
  double sigma_px = 1;
  // How the point moves for one standard deviation of its inverse depth, where that is not known.
  // In the image it is noise along the epipolar line, none where the camera has not moved.
  Eigen::Vector3d depth_axis = Eigen::Vector3d::Zero();
};

// An error in the image, whitened: what a point's depth would explain counts for less. The
// covariance is sigma_px^2 I + v v'; v is taken at one pose and held while that is improved, or a
// pose would be the better the less its points say about it.
struct MeasurementNoise {
  Eigen::Vector2d v_px = Eigen::Vector2d::Zero();
  double inverse_variance = 1;  // 1 / sigma_px^2
  double share = 0;             // 1 / (sigma_px^2 + v'v): of v v' in the information

  double Chi2(const Eigen::Vector2d& error) const {
    const double along = v_px.dot(error);
    return (error.squaredNorm() - share * along * along) * inverse_variance;
  }
};
// `R_cam_world` and `p_cam` are of the pose.
MeasurementNoise NoiseOf(const CameraModel& camera, const Eigen::Quaterniond& R_cam_world,
                         const Eigen::Vector3d& p_cam, const PointMeasurement& measurement);

// Adds J' C^-1 J and J' C^-1 error times `weight`, C the covariance of the noise.
template <int kSize>
void AddMeasurement(const Eigen::Matrix<double, 2, kSize>& J, const Eigen::Vector2d& error,
                    const MeasurementNoise& noise, double weight,
                    Eigen::Matrix<double, kSize, kSize>& hessian,
                    Eigen::Matrix<double, kSize, 1>& gradient) {
  hessian.noalias() += weight * J.transpose() * J;
  gradient.noalias() += weight * J.transpose() * error;
  if (noise.share == 0) return;
  const Eigen::Matrix<double, kSize, 1> along = J.transpose() * noise.v_px;
  hessian.noalias() -= (weight * noise.share) * along * along.transpose();
  gradient.noalias() -= (weight * noise.share * noise.v_px.dot(error)) * along;
}

// d pixel / d (omega, translation) at p_cam, for the update p_cam' = Exp(omega) * (R p_world) +
// (t + dt) about R p_world = `rotated`.
Eigen::Matrix<double, 2, 6> ProjectionJacobian(const CameraModel& camera,
                                               const Eigen::Vector3d& p_cam,
                                               const Eigen::Vector3d& rotated);

// Points below which a pose is a guess: they hold its six degrees of freedom with a few to spare
// for outliers.
inline constexpr int kMinPoseInliers = 10;

struct PoseEstimate {
  Pose T_cam_world;
  std::vector<char> is_inlier;  // of each measurement
  int num_inliers = 0;
  double reprojection_px = 0;  // root mean square over the inliers
  // Standard deviation of all measurements by what was stated, from the quarter of least error: so
  // outliers have no say, up to three quarters of them.
  double noise_scale = 1;
};

// The same of squared errors over their variances; 1 where there are none.
double NoiseScaleOf(std::vector<double> chi2);

// The pose of least reprojection error, from a start nearby: four rounds of at most ten
// Gauss-Newton steps with damping, robust (Huber) in the first two; after each, measurements beyond
// chi2(95 %, 2) = 5.991 are left out and may return later.
PoseEstimate OptimisePose(const CameraModel& camera, const Pose& T_cam_world,
                          const std::vector<PointMeasurement>& measurements);

}  // namespace mono3d::tracking
