// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <numbers>

namespace mono3d::synthetic {

constexpr double Radians(double degrees) { return degrees * std::numbers::pi / 180; }

// From a (t = 0) to b (t = 1).
inline float Mix(float a, float b, float t) { return a + t * (b - a); }
inline Eigen::Vector3f Mix(const Eigen::Vector3f& a, const Eigen::Vector3f& b, float t) {
  return a + t * (b - a);
}

}  // namespace mono3d::synthetic
