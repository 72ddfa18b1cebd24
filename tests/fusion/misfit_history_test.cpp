// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/registration/misfit_history.h"

#include <gtest/gtest.h>

#include <initializer_list>

namespace mono3d {
namespace {

constexpr double kLeast = 0.25;

MisfitHistory HistoryOf(std::initializer_list<double> misfits) {
  MisfitHistory history;
  for (const double misfit : misfits) history.Add(misfit);
  return history;
}

TEST(MisfitHistory, SaysNothingOfAFew) {
  EXPECT_EQ(MisfitHistory().Limit(kLeast, 1), kLeast);
  EXPECT_EQ(HistoryOf({0.5, 0.5, 0.5, 0.5}).Limit(kLeast, 1), kLeast);
}

TEST(MisfitHistory, StaysAtTheLeastWhereDepthMapsFit) {
  EXPECT_EQ(HistoryOf({0.02, 0.06, 0.05, 0.08, 0.21, 0.03}).Limit(kLeast, 1), kLeast);
}

TEST(MisfitHistory, FollowsWhatDepthMapsMissByThemselves) {
  EXPECT_NEAR(HistoryOf({0.1, 0.2, 0.2, 0.2, 0.4}).Limit(kLeast, 1), 0.6, 1e-12);
  EXPECT_EQ(HistoryOf({0.4, 0.6, 0.5, 0.6, 0.7}).Limit(kLeast, 1), 1);
}

TEST(MisfitHistory, ExpectsMoreOfNoisyImages) {
  EXPECT_EQ(MisfitHistory().Limit(kLeast, 2), 2 * kLeast);
  EXPECT_EQ(MisfitHistory().Limit(kLeast, 6), 1) << "what is common is at most the whole error";
  EXPECT_EQ(HistoryOf({0.02, 0.06, 0.05, 0.08, 0.21, 0.03}).Limit(kLeast, 2), 2 * kLeast);
  EXPECT_NEAR(HistoryOf({0.1, 0.2, 0.2, 0.2, 0.4}).Limit(kLeast, 2), 0.6, 1e-12) << "not both";
  EXPECT_EQ(MisfitHistory().Limit(2, 3), 2) << "as it was asked for";
}

// A tracker that is wrong by much each time is no reason to believe it more.
TEST(MisfitHistory, IsNotOfATrackerThatIsWrong) {
  EXPECT_EQ(HistoryOf({3, 2, 4, 3, 0.6, 2, 5, 0.5, 3, 0.6, 2, 3, 0.5, 0.6}).Limit(kLeast, 1),
            kLeast);
}

TEST(MisfitHistory, ForgetsWhatIsLongAgo) {
  MisfitHistory history = HistoryOf({0.6, 0.6, 0.6, 0.6, 0.6});
  for (int i = 0; i < 16; ++i) history.Add(0.02);
  EXPECT_EQ(history.Limit(kLeast, 1), kLeast);
}

}  // namespace
}  // namespace mono3d
