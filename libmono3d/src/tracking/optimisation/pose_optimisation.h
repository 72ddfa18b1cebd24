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
};

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
};

// The pose of least reprojection error, from a start nearby: four rounds of at most ten
// Gauss-Newton steps with damping, robust (Huber) in the first two; after each, measurements beyond
// chi2(95 %, 2) = 5.991 are left out and may return later.
PoseEstimate OptimisePose(const CameraModel& camera, const Pose& T_cam_world,
                          const std::vector<PointMeasurement>& measurements);

}  // namespace mono3d::tracking
