// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/surface_slope.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace mono3d::tracking {

Eigen::Vector2d FacingSlope(const CameraModel& camera, const Eigen::Vector2d& pixel) {
  const Eigen::Vector3d ray = camera.Unproject(pixel);
  return Eigen::Vector2d(ray.x() / camera.fx, ray.y() / camera.fy) / ray.squaredNorm();
}

SurfaceSlope UnknownSlope(const CameraModel& camera, const Eigen::Vector2d& pixel) {
  const Eigen::Vector2d squared_focal(camera.fx * camera.fx, camera.fy * camera.fy);
  return {FacingSlope(camera, pixel), squared_focal.asDiagonal()};
}

bool IsPlausible(const CameraModel& camera, const Eigen::Vector2d& pixel,
                 const Eigen::Vector2d& slope) {
  constexpr double kMaxTangent = 4;
  const Eigen::Vector2d lean = slope - FacingSlope(camera, pixel);
  return Eigen::Vector2d(camera.fx * lean.x(), camera.fy * lean.y()).norm() < kMaxTangent;
}

std::optional<SurfaceSlope> SlopeInOther(const CameraModel& camera, const Eigen::Quaterniond& R_b_a,
                                         const Eigen::Vector2d& pixel_a,
                                         const SurfaceSlope& slope_a,
                                         const Eigen::Vector2d& pixel_b) {
  constexpr double kMinCosine = 0.2;
  // The normal in camera a, with ray . normal = 1, and by the slope.
  const Eigen::Vector3d ray_a = camera.Unproject(pixel_a);
  Eigen::Matrix<double, 3, 2> by_slope;
  by_slope << camera.fx, 0,  //
      0, camera.fy,          //
      -camera.fx * ray_a.x(), -camera.fy * ray_a.y();
  const Eigen::Matrix3d R = R_b_a.toRotationMatrix();
  const Eigen::Vector3d normal = R * (Eigen::Vector3d::UnitZ() + by_slope * slope_a.value);
  const Eigen::Vector3d ray_b = camera.Unproject(pixel_b);
  const double facing = ray_b.dot(normal);
  if (!(facing > kMinCosine * ray_b.norm() * normal.norm())) return std::nullopt;
  SurfaceSlope slope;
  slope.value = Eigen::Vector2d(normal.x() / camera.fx, normal.y() / camera.fy) / facing;
  Eigen::Matrix<double, 2, 3> by_normal = -slope.value * ray_b.transpose();
  by_normal(0, 0) += 1 / camera.fx;
  by_normal(1, 1) += 1 / camera.fy;
  const Eigen::Matrix2d back = (by_normal / facing * R * by_slope).inverse();
  slope.information = back.transpose() * slope_a.information * back;
  if (!slope.information.allFinite()) return std::nullopt;
  return slope;
}

}  // namespace mono3d::tracking
