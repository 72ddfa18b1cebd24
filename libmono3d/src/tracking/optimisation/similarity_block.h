// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <ceres/manifold.h>
#include <ceres/product_manifold.h>
#include <ceres/rotation.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstddef>

#include "mono3d/geometry/similarity.h"

namespace mono3d::tracking {

// Quaternion w x y z as Ceres has it, translation, log of the scale.
using SimilarityBlock = std::array<double, 8>;

inline SimilarityBlock ToBlock(const Similarity& S) {
  const Eigen::Quaterniond& q = S.pose().rotation();
  const Eigen::Vector3d& t = S.pose().translation();
  return {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z(), std::log(S.scale())};
}

inline Similarity FromBlock(const SimilarityBlock& block) {
  return {std::exp(block[7]), Pose(Eigen::Quaterniond(block[0], block[1], block[2], block[3]),
                                   Eigen::Vector3d(block[4], block[5], block[6]))};
}

// How far S_b is from S_b_a * S_a: rotation, translation, log scale, each times its weight.
struct EdgeError {
  SimilarityBlock measured;
  double rotation_weight;
  double translation_weight;
  double scale_weight;
  bool about_camera;  // translation where the rotation between the two has been undone

  template <typename T>
  bool operator()(const T* const a, const T* const b, T* error) const {
    const std::array<T, 4> measured_q = {T(measured[0]), T(measured[1]), T(measured[2]),
                                         T(measured[3])};
    std::array<T, 4> expected_q;
    ceres::QuaternionProduct(measured_q.data(), a, expected_q.data());
    const std::array<T, 4> inverse_b = {b[0], -b[1], -b[2], -b[3]};
    std::array<T, 4> difference;
    ceres::QuaternionProduct(expected_q.data(), inverse_b.data(), difference.data());
    ceres::QuaternionToAngleAxis(difference.data(), error);
    std::array<T, 3> moved;
    ceres::QuaternionRotatePoint(measured_q.data(), a + 4, moved.data());
    const double scale = std::exp(measured[7]);
    for (std::size_t i = 0; i < 3; ++i) moved[i] = scale * moved[i] + measured[4 + i];
    // A rotation takes the origin of the world along, however far away, which is no error of its
    // own.
    if (about_camera) {
      using std::exp;
      const T ratio = exp(b[7] - a[7] - measured[7]);
      const std::array<T, 4> lock = {difference[0], -difference[1], -difference[2], -difference[3]};
      const std::array<T, 3> expected = moved;
      ceres::QuaternionRotatePoint(lock.data(), expected.data(), moved.data());
      for (T& coordinate : moved) coordinate *= ratio;
    }
    for (std::size_t i = 0; i < 3; ++i) {
      error[i] *= rotation_weight;
      error[3 + i] = (moved[i] - b[4 + i]) * translation_weight;
    }
    error[6] = (a[7] + measured[7] - b[7]) * scale_weight;
    return true;
  }
};

// Quaternion on its sphere, the rest as it is.
using SimilarityManifold =
    ceres::ProductManifold<ceres::QuaternionManifold, ceres::EuclideanManifold<4>>;

}  // namespace mono3d::tracking
