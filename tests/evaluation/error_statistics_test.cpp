// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/evaluation/error_statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

TEST(ErrorStatistics, AreThoseWorkedOutByHand) {
  const std::vector<double> errors = {4, 1, 3, 2};
  const ErrorStatistics statistics = ComputeStatistics(errors);
  EXPECT_EQ(statistics.count, 4);
  EXPECT_DOUBLE_EQ(statistics.mean, 2.5);
  EXPECT_DOUBLE_EQ(statistics.rmse, std::sqrt(7.5));    // (16 + 1 + 9 + 4) / 4
  EXPECT_DOUBLE_EQ(statistics.sigma, std::sqrt(1.25));  // (2.25 + 0.25 + 0.25 + 2.25) / 4
  EXPECT_DOUBLE_EQ(statistics.median, 2.5);
  EXPECT_DOUBLE_EQ(statistics.min, 1);
  EXPECT_DOUBLE_EQ(statistics.max, 4);
}

TEST(ErrorStatistics, HaveTheMiddleOneOfAnOddNumberAsMedian) {
  const std::vector<double> errors = {-7, 100, 2};
  EXPECT_DOUBLE_EQ(ComputeStatistics(errors).median, 2);
}

TEST(ErrorStatistics, AreZeroWithoutErrors) {
  EXPECT_EQ(ComputeStatistics({}).count, 0);
  EXPECT_EQ(ComputeStatistics({}).rmse, 0);
}

TEST(ErrorStatistics, RefuseWhatIsNotFinite) {
  const std::vector<double> errors = {1, std::numeric_limits<double>::quiet_NaN()};
  EXPECT_THROW(ComputeStatistics(errors), Error);
}

}  // namespace
}  // namespace mono3d
