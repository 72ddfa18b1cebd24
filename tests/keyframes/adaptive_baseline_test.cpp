// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "keyframes/adaptive_baseline.h"

#include <gtest/gtest.h>

namespace mono3d {
namespace {

constexpr double kMax = 5;

// Reports maps of the step in use; `is_good` says of which steps maps are dense.
template <typename IsGood>
void Report(AdaptiveBaseline& baseline, int num_maps, const IsGood& is_good) {
  for (int i = 0; i < num_maps; ++i) {
    const std::size_t step = baseline.step();
    const double density = is_good(step) ? 0.9 : 0.2;
    baseline.ReportDepthQuality(step, density, 0.5 * density);
  }
}

TEST(AdaptiveBaseline, StaysAsWideAsAllowedWhileMapsAreDense) {
  AdaptiveBaseline baseline(kMax);
  EXPECT_EQ(baseline.angle_deg(), kMax);
  Report(baseline, 50, [](std::size_t) { return true; });
  EXPECT_EQ(baseline.angle_deg(), kMax);
}

TEST(AdaptiveBaseline, ToleratesOnePoorMap) {
  AdaptiveBaseline baseline(kMax);
  for (const double density : {0.9, 0.1, 0.9, 0.1, 0.9})
    baseline.ReportDepthQuality(0, density, density);
  EXPECT_EQ(baseline.step(), 0U);
}

TEST(AdaptiveBaseline, BecomesNarrowerUntilMapsAreDense) {
  AdaptiveBaseline baseline(kMax);
  const auto only_narrow = [](std::size_t step) { return step == 2; };
  Report(baseline, 2, only_narrow);
  EXPECT_EQ(baseline.step(), 1U);
  Report(baseline, 2, only_narrow);
  EXPECT_EQ(baseline.step(), 2U);
  EXPECT_NEAR(baseline.angle_deg(), kMax / 2, 1e-12);
  Report(baseline, 6, only_narrow);
  EXPECT_EQ(baseline.step(), 2U);
}

TEST(AdaptiveBaseline, TakesTheBestOfPoorOnes) {
  AdaptiveBaseline baseline(kMax);
  const double confidence[] = {0.1, 0.3, 0.2};
  for (int i = 0; i < 6; ++i)
    baseline.ReportDepthQuality(baseline.step(), 0.3, confidence[baseline.step()]);
  EXPECT_EQ(baseline.step(), 1U);
  for (int i = 0; i < 4; ++i)
    baseline.ReportDepthQuality(baseline.step(), 0.3, confidence[baseline.step()]);
  EXPECT_EQ(baseline.step(), 1U);
}

TEST(AdaptiveBaseline, TriesTheWiderOnesAgainAfterAWhile) {
  AdaptiveBaseline baseline(kMax);
  Report(baseline, 2, [](std::size_t step) { return step == 1; });
  EXPECT_EQ(baseline.step(), 1U);
  Report(baseline, 10, [](std::size_t) { return true; });
  EXPECT_EQ(baseline.step(), 1U);
  Report(baseline, 10, [](std::size_t) { return true; });
  EXPECT_EQ(baseline.step(), 0U);
}

TEST(AdaptiveBaseline, ReactsOnlyToTheStepInUse) {
  AdaptiveBaseline baseline(kMax);
  for (int i = 0; i < 4; ++i) baseline.ReportDepthQuality(2, 0.1, 0.05);
  EXPECT_EQ(baseline.step(), 0U);
}

}  // namespace
}  // namespace mono3d
