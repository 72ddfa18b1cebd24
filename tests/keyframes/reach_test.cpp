// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "keyframes/reach.h"

#include <gtest/gtest.h>

namespace mono3d {
namespace {

constexpr double kMax = 0.08;

// Hears maps of the width that it asks for; `good` has the widths of which maps are dense.
template <typename IsGood>
void Listen(Reach& reach, int num_maps, const IsGood& is_good) {
  for (int i = 0; i < num_maps; ++i) {
    const std::size_t width = reach.width();
    const double density = is_good(width) ? 0.9 : 0.2;
    reach.ReportDepthQuality(width, density, 0.5 * density);
  }
}

TEST(Reach, StaysAsWideAsAllowedWhileMapsAreDense) {
  Reach reach(kMax);
  EXPECT_EQ(reach.ratio(), kMax);
  Listen(reach, 50, [](std::size_t) { return true; });
  EXPECT_EQ(reach.ratio(), kMax);
}

TEST(Reach, BearsWithOnePoorMap) {
  Reach reach(kMax);
  for (const double density : {0.9, 0.1, 0.9, 0.1, 0.9})
    reach.ReportDepthQuality(0, density, density);
  EXPECT_EQ(reach.width(), 0U);
}

TEST(Reach, BecomesNarrowerUntilMapsAreDense) {
  Reach reach(kMax);
  const auto only_narrow = [](std::size_t width) { return width == 2; };
  Listen(reach, 2, only_narrow);
  EXPECT_EQ(reach.width(), 1U);
  Listen(reach, 2, only_narrow);
  EXPECT_EQ(reach.width(), 2U);
  EXPECT_NEAR(reach.ratio(), kMax / 2, 1e-12);
  Listen(reach, 6, only_narrow);
  EXPECT_EQ(reach.width(), 2U);
}

TEST(Reach, TakesTheBestOfPoorOnes) {
  Reach reach(kMax);
  const double worth[] = {0.1, 0.3, 0.2};
  for (int i = 0; i < 6; ++i) reach.ReportDepthQuality(reach.width(), 0.3, worth[reach.width()]);
  EXPECT_EQ(reach.width(), 1U);
  for (int i = 0; i < 4; ++i) reach.ReportDepthQuality(reach.width(), 0.3, worth[reach.width()]);
  EXPECT_EQ(reach.width(), 1U);
}

TEST(Reach, TriesTheWiderOnesAgainAfterAWhile) {
  Reach reach(kMax);
  Listen(reach, 2, [](std::size_t width) { return width == 1; });
  EXPECT_EQ(reach.width(), 1U);
  Listen(reach, 10, [](std::size_t) { return true; });
  EXPECT_EQ(reach.width(), 1U);
  Listen(reach, 10, [](std::size_t) { return true; });
  EXPECT_EQ(reach.width(), 0U);
}

TEST(Reach, HeedsOnlyTheWidthInUse) {
  Reach reach(kMax);
  for (int i = 0; i < 4; ++i) reach.ReportDepthQuality(2, 0.1, 0.05);
  EXPECT_EQ(reach.width(), 0U);
}

}  // namespace
}  // namespace mono3d
