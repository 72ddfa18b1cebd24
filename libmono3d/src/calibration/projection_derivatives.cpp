// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/projection_derivatives.h"

#include <ceres/jet.h>

#include <Eigen/Geometry>
#include <cmath>

#include "calibration/parameter_projection.h"

namespace mono3d::calibration {

Eigen::Matrix3d CrossMatrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d cross;
  cross << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return cross;
}

Turn::Turn(const Eigen::Vector3d& rotation) {
  constexpr double kSmall = 1e-4;  // the next terms of the series are below 1e-10 there
  const double squared = rotation.squaredNorm();
  double sine = 1 - squared / 6;       // sin(angle) / angle
  double cosine = 0.5 - squared / 24;  // (1 - cos(angle)) / angle^2
  double third = 1. / 6 - squared / 120;
  if (squared > kSmall * kSmall) {
    const double angle = std::sqrt(squared);
    sine = std::sin(angle) / angle;
    cosine = (1 - std::cos(angle)) / squared;
    third = (1 - sine) / squared;
  }
  const Eigen::Matrix3d cross = CrossMatrix(rotation);
  const Eigen::Matrix3d twice = cross * cross;
  R = Eigen::Matrix3d::Identity() + sine * cross + cosine * twice;
  left = Eigen::Matrix3d::Identity() + cosine * cross + third * twice;
}

PosedPoint::PosedPoint(const double* pose, const double* p_first)
    : turn_(Eigen::Map<const Eigen::Vector3d>(pose)),
      rotated_(turn_.R * Eigen::Map<const Eigen::Vector3d>(p_first)),
      p_cam_(rotated_ + Eigen::Map<const Eigen::Vector3d>(pose + 3)) {}

void PosedPoint::WriteDerivatives(const Eigen::Matrix<double, 2, 3>& by_cam, double* by_pose,
                                  double* by_point) const {
  if (by_pose != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 2, 6, Eigen::RowMajor>> J(by_pose);
    J.leftCols<3>() = -by_cam * CrossMatrix(rotated_) * turn_.left;
    J.rightCols<3>() = by_cam;
  }
  if (by_point != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>> J(by_point);
    J = by_cam * turn_.R;
  }
}

LensPixel::LensPixel(LensModel lens, const double* camera, const Eigen::Vector3d& p_cam) {
  using Jet = ceres::Jet<double, 3 + kNumOfLens>;
  Jet point[3];
  Jet parameters[kNumOfLens];
  Jet found[2];
  for (int i = 0; i < 3; ++i) point[i] = Jet(p_cam[i], i);
  for (int i = 0; i < kNumOfLens; ++i) parameters[i] = Jet(camera[i], 3 + i);
  ProjectParameters(lens, parameters, point, found);
  for (int i = 0; i < 2; ++i) {
    pixel[i] = found[i].a;
    by_point.row(i) = found[i].v.head<3>().transpose();
    by_lens.row(i) = found[i].v.tail<kNumOfLens>().transpose();
  }
}

}  // namespace mono3d::calibration
