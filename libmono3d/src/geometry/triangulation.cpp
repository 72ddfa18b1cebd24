// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/triangulation.h"

#include <Eigen/SVD>
#include <cmath>

namespace mono3d {

std::optional<Eigen::Vector3d> Triangulate(const Eigen::Vector3d& ray_a,
                                           const Eigen::Vector3d& ray_b, const Pose& T_b_a) {
  const Eigen::Matrix<double, 3, 4> P_b = T_b_a.Matrix().topRows<3>();
  Eigen::Matrix<double, 3, 4> P_a = Eigen::Matrix<double, 3, 4>::Zero();
  P_a.leftCols<3>().setIdentity();
  Eigen::Matrix4d A;
  A.row(0) = ray_a.x() * P_a.row(2) - P_a.row(0);
  A.row(1) = ray_a.y() * P_a.row(2) - P_a.row(1);
  A.row(2) = ray_b.x() * P_b.row(2) - P_b.row(0);
  A.row(3) = ray_b.y() * P_b.row(2) - P_b.row(1);
  const Eigen::JacobiSVD<Eigen::Matrix4d> svd(A, Eigen::ComputeFullV);
  const Eigen::Vector4d point_h = svd.matrixV().col(3);
  const Eigen::Vector3d p_a = point_h.head<3>() / point_h.w();
  if (!p_a.allFinite() || p_a.z() <= 0) return std::nullopt;
  if ((T_b_a * p_a).z() <= 0) return std::nullopt;
  return p_a;
}

double CosParallax(const Eigen::Vector3d& point, const Eigen::Vector3d& centre_a,
                   const Eigen::Vector3d& centre_b) {
  const Eigen::Vector3d a = centre_a - point;
  const Eigen::Vector3d b = centre_b - point;
  return a.dot(b) / std::sqrt(a.squaredNorm() * b.squaredNorm());
}

}  // namespace mono3d
