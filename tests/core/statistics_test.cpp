// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/core/statistics.h"

#include <gtest/gtest.h>

#include <vector>

namespace mono3d {
namespace {

TEST(Median, IsTheValueInTheMiddleOrTheMeanOfTwo) {
  EXPECT_EQ(Median(std::vector<double>{5}), 5);
  EXPECT_EQ(Median(std::vector<double>{9, 1, 4}), 4);
  EXPECT_EQ(Median(std::vector<double>{9, 1, 4, 2}), 3);
  EXPECT_EQ(Median(std::vector<float>{1, 2}), 1.5F);
}

TEST(UpperMedian, IsOneOfTheValues) {
  EXPECT_EQ(UpperMedian(std::vector<double>{5}), 5);
  EXPECT_EQ(UpperMedian(std::vector<double>{9, 1, 4}), 4);
  EXPECT_EQ(UpperMedian(std::vector<double>{9, 1, 4, 2}), 4);
  EXPECT_EQ(UpperMedian(std::vector<float>{2, 1}), 2.F);
}

TEST(UpperMedianOrZero, IsZeroOfNothing) {
  EXPECT_EQ(UpperMedianOrZero(std::vector<double>{}), 0);
  EXPECT_EQ(UpperMedianOrZero(std::vector<float>{7, 3, 9}), 7.F);
}

TEST(Quantile, IsTheValueAtAShareOfTheSortedOnes) {
  const std::vector<double> values = {40, 10, 50, 20, 30};
  EXPECT_EQ(Quantile(values, 0), 10);
  EXPECT_EQ(Quantile(values, 0.25), 20);
  EXPECT_EQ(Quantile(values, 0.49), 20) << "the place is rounded down";
  EXPECT_EQ(Quantile(values, 0.5), 30);
  EXPECT_EQ(Quantile(values, 1), 50);
  EXPECT_EQ(Quantile(std::vector<double>{7}, 0.9), 7);
}

}  // namespace
}  // namespace mono3d
