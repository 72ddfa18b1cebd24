// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/homography.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace mono3d {
Eigen::Matrix3d NormalisingTransform(std::span<const PointPair> pairs,
                                     Eigen::Vector2d PointPair::*side) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const PointPair& pair : pairs) mean += pair.*side;
  mean /= static_cast<double>(pairs.size());
  double distance = 0;
  for (const PointPair& pair : pairs) distance += (pair.*side - mean).norm();
  distance /= static_cast<double>(pairs.size());
  const double scale = distance > 0 ? std::sqrt(2.0) / distance : 1;
  Eigen::Matrix3d T;
  T << scale, 0, -scale * mean.x(), 0, scale, -scale * mean.y(), 0, 0, 1;
  return T;
}

std::optional<Eigen::Matrix3d> FitHomography(std::span<const PointPair> pairs) {
  if (pairs.size() < 4) return std::nullopt;
  const Eigen::Matrix3d T_a = NormalisingTransform(pairs, &PointPair::a);
  const Eigen::Matrix3d T_b = NormalisingTransform(pairs, &PointPair::b);
  Eigen::Matrix<double, 9, 9> AtA = Eigen::Matrix<double, 9, 9>::Zero();
  for (const PointPair& pair : pairs) {
    const Eigen::Vector3d a = T_a * pair.a.homogeneous();
    const Eigen::Vector3d b = T_b * pair.b.homogeneous();
    Eigen::Matrix<double, 2, 9> A = Eigen::Matrix<double, 2, 9>::Zero();
    A.block<1, 3>(0, 3) = -a.transpose();
    A.block<1, 3>(0, 6) = b.y() * a.transpose();
    A.block<1, 3>(1, 0) = a.transpose();
    A.block<1, 3>(1, 6) = -b.x() * a.transpose();
    AtA += A.transpose() * A;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> solver(AtA);
  // Two vanishing eigenvalues: a whole family of homographies fits.
  if (solver.eigenvalues()[1] < 1e-12 * solver.eigenvalues()[8]) return std::nullopt;
  const Eigen::Matrix<double, 9, 1> h = solver.eigenvectors().col(0);
  Eigen::Matrix3d H_normalised;
  H_normalised << h.segment<3>(0).transpose(), h.segment<3>(3).transpose(),
      h.segment<3>(6).transpose();
  const Eigen::Matrix3d H = T_b.inverse() * H_normalised * T_a;
  if (!H.allFinite() || std::abs(H.determinant()) < 1e-12 * std::pow(H.norm(), 3)) {
    return std::nullopt;
  }
  return Eigen::Matrix3d(H / H.norm());
}

std::vector<PlaneMotion> DecomposeHomography(const Eigen::Matrix3d& H) {
  // Singular values and right singular vectors of H, by descending value.
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(H.transpose() * H);
  const Eigen::Vector3d squares = solver.eigenvalues().reverse().cwiseMax(0.0);
  if (!(squares[2] > 0)) return {};
  const double middle = std::sqrt(squares[1]);
  const Eigen::Vector3d sigma = squares.cwiseSqrt() / middle;
  const Eigen::Matrix3d V = solver.eigenvectors().rowwise().reverse();
  // Below this ratio the translation cannot be told from noise.
  constexpr double kMinRatio = 1.00001;
  if (!(sigma[0] > kMinRatio * sigma[2])) return {};
  // The middle singular value of R + t n^T / d is 1, its determinant the ratio of the two cameras'
  // distances from the plane, which is positive as both see the same side of it.
  const Eigen::Matrix3d normalised = H / (H.determinant() < 0 ? -middle : middle);
  const double a = std::sqrt(std::max(0.0, 1 - sigma[2] * sigma[2]));
  const double c = std::sqrt(std::max(0.0, sigma[0] * sigma[0] - 1));
  std::vector<PlaneMotion> motions;
  for (const double sign : {1.0, -1.0}) {
    // H keeps the lengths of the vectors in the plane of v2 and u.
    const Eigen::Vector3d v2 = V.col(1);
    const Eigen::Vector3d u = (a * V.col(0) + sign * c * V.col(2)).normalized();
    const Eigen::Vector3d normal = v2.cross(u);
    const Eigen::Vector3d Hv2 = normalised * v2;
    const Eigen::Vector3d Hu = normalised * u;
    Eigen::Matrix3d before;
    before << v2, u, normal;
    Eigen::Matrix3d after;
    after << Hv2, Hu, Hv2.cross(Hu);
    const Eigen::Matrix3d R = after * before.transpose();
    const Eigen::Vector3d t = (normalised - R) * normal;
    const double towards = normal.z() < 0 ? -1 : 1;  // the plane lies in front of camera a
    motions.push_back({Pose(R, Eigen::Vector3d(towards * t)), towards * normal});
  }
  return motions;
}

}  // namespace mono3d
