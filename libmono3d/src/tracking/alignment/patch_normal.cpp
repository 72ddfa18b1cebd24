// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/alignment/patch_normal.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace mono3d::tracking {

Eigen::Vector2d FacingNormal(const CameraModel& camera, const Eigen::Vector2d& pixel) {
  const Eigen::Vector3d ray = camera.Unproject(pixel);
  return Eigen::Vector2d(ray.x() / camera.fx, ray.y() / camera.fy) / ray.squaredNorm();
}

PatchNormal UnknownNormal(const CameraModel& camera, const Eigen::Vector2d& pixel) {
  const Eigen::Vector2d squared_focal(camera.fx * camera.fx, camera.fy * camera.fy);
  return {FacingNormal(camera, pixel), squared_focal.asDiagonal()};
}

bool IsPlausible(const CameraModel& camera, const Eigen::Vector2d& pixel,
                 const Eigen::Vector2d& normal) {
  constexpr double kMaxTangent = 4;  // 76 degrees
  const Eigen::Vector2d lean = normal - FacingNormal(camera, pixel);
  return Eigen::Vector2d(camera.fx * lean.x(), camera.fy * lean.y()).norm() < kMaxTangent;
}

std::optional<PatchNormal> NormalInOther(const CameraModel& camera, const Eigen::Quaterniond& R_b_a,
                                         const Eigen::Vector2d& pixel_a,
                                         const PatchNormal& normal_a,
                                         const Eigen::Vector2d& pixel_b) {
  constexpr double kMinCosine = 0.2;  // 78 degrees, as IsPlausible
  // As a vector in camera a whose product with the ray is 1, and its derivative by `value`.
  const Eigen::Vector3d ray_a = camera.Unproject(pixel_a);
  Eigen::Matrix<double, 3, 2> by_normal;
  by_normal << camera.fx, 0,  //
      0, camera.fy,           //
      -camera.fx * ray_a.x(), -camera.fy * ray_a.y();
  const Eigen::Matrix3d R = R_b_a.toRotationMatrix();
  const Eigen::Vector3d plane_normal = R * (Eigen::Vector3d::UnitZ() + by_normal * normal_a.value);
  const Eigen::Vector3d ray_b = camera.Unproject(pixel_b);
  const double facing = ray_b.dot(plane_normal);
  if (!(facing > kMinCosine * ray_b.norm() * plane_normal.norm())) return std::nullopt;
  PatchNormal normal;
  normal.value =
      Eigen::Vector2d(plane_normal.x() / camera.fx, plane_normal.y() / camera.fy) / facing;
  Eigen::Matrix<double, 2, 3> by_plane_normal = -normal.value * ray_b.transpose();
  by_plane_normal(0, 0) += 1 / camera.fx;
  by_plane_normal(1, 1) += 1 / camera.fy;
  const Eigen::Matrix2d back = (by_plane_normal / facing * R * by_normal).inverse();
  normal.information = back.transpose() * normal_a.information * back;
  if (!normal.information.allFinite()) return std::nullopt;
  return normal;
}

}  // namespace mono3d::tracking
