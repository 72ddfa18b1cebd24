// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

namespace mono3d {

using Vector7d = Eigen::Matrix<double, 7, 1>;
using Matrix7d = Eigen::Matrix<double, 7, 7>;

// Surfels and words of one row of what shaders/fusion/register.comp writes.
inline constexpr std::uint32_t kSurfelsPerRegistrationRow = 16;
inline constexpr std::uint32_t kFloatsPerRegistrationRow = 56;

// The normal equations of one evaluation of the registration, and what they rest on. Unknowns, in
// this order: rotation (rad) and translation (the depth map's unit) of the model in the camera's
// frame, logarithm of the scale of the measured depths. Residuals are in sigmas.
struct RegistrationSystem {
  Matrix7d information = Matrix7d::Zero();  // sum of w J J^T
  Vector7d gradient = Vector7d::Zero();     // sum of w J r
  double depth_cost = 0;                    // sum of w r^2 over the surfels that agree
  std::int64_t num_agree = 0;               // surfels on the surface that the depth map shows
  std::int64_t num_before = 0;              // surfels in view that stand before it
  std::int64_t num_behind = 0;              // and behind it: hidden, or wrong as well
  double grey_cost = 0;
  std::int64_t num_grey = 0;  // surfels whose grey value was compared
  // By the weights of the grey residuals, where there were some.
  double image_grey_mean = 0;
  double image_grey_sigma = 0;
  double surfel_grey_mean = 0;
  double surfel_grey_sigma = 0;
  double grey_covariance = 0;
};

// Adds up rows in double precision, in their order.
RegistrationSystem SumRegistrationRows(std::span<const float> rows);

}  // namespace mono3d
