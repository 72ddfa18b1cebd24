// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace mono3d {

inline constexpr double kDegreesPerRadian = 180 / std::numbers::pi;

// The part of R_a_b about the optical axis, -180 to 180 degrees: what lies to the right in the
// picture of b lies so far clockwise of that in the picture of a.
inline double Roll_deg(const Eigen::Quaterniond& R_a_b) {
  return std::remainder(2 * std::atan2(R_a_b.z(), R_a_b.w()) * kDegreesPerRadian, 360);
}

// A roll in whole quarter turns, and what is left of it.
struct QuarterTurns {
  unsigned num = 0;          // 0 to 3
  double remainder_deg = 0;  // -45 to 45
};

inline QuarterTurns QuarterTurnsOf(const Eigen::Quaterniond& R_a_b) {
  const double roll_deg = Roll_deg(R_a_b);
  const auto num = static_cast<int>(std::lround(roll_deg / 90));
  return {static_cast<unsigned>(num) & 3U, roll_deg - 90 * num};
}

}  // namespace mono3d
