// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "core/clamped_int.h"

#include <gtest/gtest.h>

#include <limits>

namespace mono3d {
namespace {

TEST(ClampedInt, IsTheIntegerPart) {
  EXPECT_EQ(ClampedInt(3.9, 0, 10), 3);
  EXPECT_EQ(ClampedInt(0.5, 0, 10), 0);
  EXPECT_EQ(ClampedInt(-1, 0, 10), 0);
  EXPECT_EQ(ClampedInt(10.5, 0, 10), 10);
}

TEST(ClampedInt, TakesWhatAnIntDoesNotHold) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(ClampedInt(1e18, 0, 10), 10);
  EXPECT_EQ(ClampedInt(-1e18, 0, 10), 0);
  EXPECT_EQ(ClampedInt(kInfinity, 2, 10), 10);
  EXPECT_EQ(ClampedInt(-kInfinity, 2, 10), 2);
  EXPECT_EQ(ClampedInt(std::numeric_limits<double>::quiet_NaN(), 2, 10), 2);
}

}  // namespace
}  // namespace mono3d
