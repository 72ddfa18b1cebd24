// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cmath>

#include "calibration/camera_parameters.h"
#include "mono3d/geometry/camera_model.h"

namespace mono3d::calibration {

// In focal lengths from the principal point.
template <typename T>
struct ImagePoint {
  T x;
  T y;
};

template <typename T>
ImagePoint<T> ProjectBrown(const T* camera, const T* p_cam) {
  const T x = p_cam[0] / p_cam[2];
  const T y = p_cam[1] / p_cam[2];
  const T r2 = x * x + y * y;
  const T radial = T(1) + r2 * (camera[kK1] + r2 * (SecondRadial(camera) + r2 * camera[kK3]));
  const T& p1 = camera[kP1];
  const T& p2 = camera[kP2];
  return {x * radial + T(2) * p1 * x * y + p2 * (r2 + T(2) * x * x),
          y * radial + p1 * (r2 + T(2) * y * y) + T(2) * p2 * x * y};
}

template <typename T>
ImagePoint<T> ProjectFisheye(const T* camera, const T* p_cam) {
  using std::atan2;
  using std::sqrt;
  const T r2 = p_cam[0] * p_cam[0] + p_cam[1] * p_cam[1];
  // On the axis the root has no derivative; radius and angle are the same there.
  constexpr double kOnAxis = 1e-16;
  if (r2 < kOnAxis * p_cam[2] * p_cam[2]) return {p_cam[0] / p_cam[2], p_cam[1] / p_cam[2]};
  const T r = sqrt(r2);
  const T theta = atan2(r, p_cam[2]);
  const T t2 = theta * theta;
  const T radial =
      T(1) +
      t2 * (camera[kK1] + t2 * (camera[kK2] + t2 * (camera[kFisheyeK3] + t2 * camera[kFisheyeK4])));
  const T scale = theta * radial / r;
  return {scale * p_cam[0], scale * p_cam[1]};
}

// The model of ProjectDistorted with the parameters of the adjustment, for numbers and for Jets of
// Ceres. z forward must be positive.
template <typename T>
void ProjectParameters(LensModel lens, const T* camera, const T* p_cam, T* pixel) {
  using std::exp;
  const ImagePoint<T> point =
      lens == LensModel::kFisheye ? ProjectFisheye(camera, p_cam) : ProjectBrown(camera, p_cam);
  const T fx = exp(camera[kLogFocal]);
  pixel[0] = fx * point.x + camera[kCx];
  pixel[1] = fx * exp(camera[kLogAspect]) * point.y + camera[kCy];
}

}  // namespace mono3d::calibration
