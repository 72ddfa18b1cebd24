// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/registration/system.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace mono3d {
namespace {

// Of a row: 4 times J_k * J(0..3), 7 times J_k * (J(4..6), r), three times four further sums.
using Sums = std::array<double, kFloatsPerRegistrationRow>;
constexpr std::size_t kTail = 16;
constexpr std::size_t kDepth = 44;
constexpr std::size_t kLight = 48;
constexpr std::size_t kLight2 = 52;

double Sigma(double sum_of_squares, double mean, double count) {
  return std::sqrt(std::max(sum_of_squares / count - mean * mean, 0.0));
}

}  // namespace

RegistrationSystem SumRegistrationRows(std::span<const float> rows) {
  Sums sums{};
  for (std::size_t i = 0; i + sums.size() <= rows.size(); i += sums.size()) {
    for (std::size_t k = 0; k < sums.size(); ++k) sums[k] += rows[i + k];
  }
  RegistrationSystem system;
  for (int row = 0; row < 7; ++row) {
    for (int col = 0; col < 3; ++col) {
      const double sum = sums[kTail + 4 * static_cast<std::size_t>(row) + col];
      system.information(row, 4 + col) = system.information(4 + col, row) = sum;
    }
    system.gradient(row) = sums[kTail + 4 * static_cast<std::size_t>(row) + 3];
  }
  for (int row = 0; row < 4; ++row) {
    for (int col = 0; col < 4; ++col) {
      system.information(row, col) = sums[4 * static_cast<std::size_t>(row) + col];
    }
  }
  system.depth_cost = sums[kDepth];
  system.num_agree = std::llround(sums[kDepth + 1]);
  system.num_before = std::llround(sums[kDepth + 2]);
  system.num_behind = std::llround(sums[kDepth + 3]);
  system.grey_cost = sums[kLight];
  system.num_grey = std::llround(sums[kLight + 1]);
  if (system.num_grey == 0) return system;
  const double count = sums[kLight2 + 2];
  system.image_grey_mean = sums[kLight + 2] / count;
  system.surfel_grey_mean = sums[kLight + 3] / count;
  system.image_grey_sigma = Sigma(sums[kLight2], system.image_grey_mean, count);
  system.surfel_grey_sigma = Sigma(sums[kLight2 + 1], system.surfel_grey_mean, count);
  system.grey_covariance =
      sums[kLight2 + 3] / count - system.image_grey_mean * system.surfel_grey_mean;
  return system;
}

}  // namespace mono3d
