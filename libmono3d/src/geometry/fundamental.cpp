// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/fundamental.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>

namespace mono3d {

std::optional<Eigen::Matrix3d> FitFundamental(std::span<const PointPair> pairs) {
  if (pairs.size() < 8) return std::nullopt;
  const Eigen::Matrix3d T_a = NormalisingTransform(pairs, &PointPair::a);
  const Eigen::Matrix3d T_b = NormalisingTransform(pairs, &PointPair::b);
  Eigen::Matrix<double, 9, 9> AtA = Eigen::Matrix<double, 9, 9>::Zero();
  for (const PointPair& pair : pairs) {
    const Eigen::Vector3d a = T_a * pair.a.homogeneous();
    const Eigen::Vector3d b = T_b * pair.b.homogeneous();
    Eigen::Matrix<double, 9, 1> row;
    row << b.x() * a, b.y() * a, a;
    AtA.noalias() += row * row.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> solver(AtA);
  // Two vanishing eigenvalues: a whole family of matrices fits.
  if (solver.eigenvalues()[1] < 1e-12 * solver.eigenvalues()[8]) return std::nullopt;
  const Eigen::Matrix<double, 9, 1> f = solver.eigenvectors().col(0);
  Eigen::Matrix3d F;
  F << f.segment<3>(0).transpose(), f.segment<3>(3).transpose(), f.segment<3>(6).transpose();
  // The nearest matrix of rank 2: without the part along the weakest right singular vector.
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> weakest(F.transpose() * F);
  const Eigen::Vector3d v = weakest.eigenvectors().col(0);
  F = T_b.transpose() * (F - F * v * v.transpose()) * T_a;
  if (!F.allFinite() || !(F.norm() > 0)) return std::nullopt;
  return Eigen::Matrix3d(F / F.norm());
}

Eigen::Matrix3d FundamentalFromMotion(const Pose& T_b_a, const Eigen::Matrix3d& K_a,
                                      const Eigen::Matrix3d& K_b) {
  const Eigen::Vector3d& t = T_b_a.translation();
  Eigen::Matrix3d t_cross;
  t_cross << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0;
  return K_b.inverse().transpose() * t_cross * T_b_a.rotation().toRotationMatrix() * K_a.inverse();
}

std::array<Pose, 4> DecomposeEssential(const Eigen::Matrix3d& E) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(E, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d W;
  W << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  Eigen::Matrix3d R1 = svd.matrixU() * W * svd.matrixV().transpose();
  Eigen::Matrix3d R2 = svd.matrixU() * W.transpose() * svd.matrixV().transpose();
  if (R1.determinant() < 0) R1 = -R1;
  if (R2.determinant() < 0) R2 = -R2;
  const Eigen::Vector3d t = svd.matrixU().col(2);
  return {Pose(R1, t), Pose(R1, Eigen::Vector3d(-t)), Pose(R2, t), Pose(R2, Eigen::Vector3d(-t))};
}

double SquaredEpipolarDistance(const Eigen::Matrix3d& F, const Eigen::Vector2d& a,
                               const Eigen::Vector2d& b) {
  const Eigen::Vector3d line = F * a.homogeneous();
  const double value = line.dot(b.homogeneous());
  return value * value / line.head<2>().squaredNorm();
}

}  // namespace mono3d
