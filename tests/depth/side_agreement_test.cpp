// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/side_agreement.h"

#include <gtest/gtest.h>

namespace mono3d {
namespace {

// Two things of which each differs from a third in a share p of its bits, independently.
double Independent(double p) { return 2 * p * (1 - p); }

TEST(AreUnrelated, WhereSidesHaveNothingInCommonButThatTheySuitTheReference) {
  for (const double chance : {0.31, 0.35, 0.4}) {
    EXPECT_TRUE(AreUnrelated({chance, chance, Independent(chance), chance})) << chance;
  }
}

// Every image has bits of what is there, a share q of them wrong by its own noise: all three pairs
// differ alike.
TEST(AreUnrelated, NotWhereNoiseAloneKeepsTheImagesApart) {
  for (const double noise : {0.02, 0.1, 0.2, 0.3}) {
    const double pair = Independent(noise);
    EXPECT_FALSE(AreUnrelated({pair, pair, pair, pair})) << noise;
  }
}

TEST(AreUnrelated, NotWhereWindowsAreNearlyTheSame) {
  EXPECT_FALSE(AreUnrelated({0.2, 0.2, Independent(0.2), 0.2}));
  EXPECT_FALSE(AreUnrelated({0, 0, 0, 0}));
}

TEST(AreUnrelated, OneSideThatDiffersIsEnoughToAsk) {
  const double independent = 0.1 + 0.4 - 2 * 0.1 * 0.4;
  EXPECT_TRUE(AreUnrelated({0.1, 0.4, independent, 0.4}));
  EXPECT_TRUE(AreUnrelated({0.4, 0.1, independent, 0.4}));
  EXPECT_FALSE(AreUnrelated({0.4, 0.1, 0.25, 0.4}));
}

}  // namespace
}  // namespace mono3d
