// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <ceres/rotation.h>

#include <Eigen/Core>
#include <array>
#include <cstddef>

namespace mono3d::tracking {

// The centre of a camera minus where it was measured, in standard deviations. `camera` is the
// rotation vector and the translation of T_cam_metric.
struct CentreError {
  Eigen::Vector3d p_m;
  Eigen::Vector3d weight;  // one over the standard deviations; 0: not measured

  template <typename T>
  bool operator()(const T* const camera, T* error) const {
    const std::array<T, 3> inverse = {-camera[0], -camera[1], -camera[2]};
    std::array<T, 3> centre;
    ceres::AngleAxisRotatePoint(inverse.data(), camera + 3, centre.data());
    for (int i = 0; i < 3; ++i) {
      error[i] = (-centre.at(static_cast<std::size_t>(i)) - p_m[i]) * weight[i];
    }
    return true;
  }
};

// One over each; 0 of what is not known.
inline Eigen::Vector3d WeightOf(const Eigen::Vector3d& sigma) {
  return (sigma.array() > 0).select(sigma.cwiseInverse(), 0.);
}

}  // namespace mono3d::tracking
