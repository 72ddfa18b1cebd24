// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "geo/position_noise.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <vector>

namespace mono3d {
namespace {

// The filter is the Cholesky factor of the covariance, row by row.
TEST(PositionNoise, WhitensAsTheCholeskyFactorOfItsCovarianceDoes) {
  const PositionNoise noise{1.7, 20, 0.4};
  const std::vector<double> times_s = {0, 1, 2.5, 30, 31, 90};
  const std::vector<bool> is_used = {true, true, false, true, true, true};
  const Eigen::MatrixXd rows = Eigen::MatrixXd::Random(6, 3);
  const std::vector<int> used = {0, 1, 3, 4, 5};
  Eigen::MatrixXd covariance(5, 5);
  Eigen::MatrixXd used_rows(5, 3);
  for (int i = 0; i < 5; ++i) {
    used_rows.row(i) = rows.row(used[static_cast<std::size_t>(i)]);
    for (int k = 0; k < 5; ++k) {
      const double step_s =
          std::abs(times_s[static_cast<std::size_t>(used[static_cast<std::size_t>(i)])] -
                   times_s[static_cast<std::size_t>(used[static_cast<std::size_t>(k)])]);
      covariance(i, k) = noise.wander_m * noise.wander_m * std::exp(-step_s / noise.correlation_s);
    }
    covariance(i, i) += noise.white_m * noise.white_m;
  }
  const Eigen::LLT<Eigen::MatrixXd> factor(covariance);
  const WhitenedRows white = Whiten(rows, times_s, is_used, noise);
  EXPECT_LT((white.rows - factor.matrixL().solve(used_rows)).norm(), 1e-9);
  EXPECT_NEAR(white.sum_log_sigma, std::log(factor.matrixLLT().diagonal().prod()), 1e-9);
}

TEST(PositionNoise, ShapesAreOfUnitVarianceAndAllOfTheProbability) {
  double sum = 0;
  for (const NoiseShape& shape : NoiseShapes()) {
    EXPECT_NEAR(std::hypot(shape.unit.wander_m, shape.unit.white_m), 1, 1e-12);
    sum += std::exp(shape.log_prior);
  }
  EXPECT_NEAR(sum, 1, 1e-12);
}

}  // namespace
}  // namespace mono3d
