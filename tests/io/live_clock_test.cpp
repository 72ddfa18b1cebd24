// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/live_clock.h"

#include <gmock/gmock.h>

#include <limits>

namespace mono3d {
namespace {

constexpr double kClose_s = 1e-9;

TEST(LiveClock, GoesByTheStampsOfTheStreamWhereTheyIncrease) {
  LiveClock clock;
  EXPECT_NEAR(clock.Add(500.0, 7), 0, kClose_s);
  EXPECT_NEAR(clock.Add(500.1, 7.3), 0.1, kClose_s) << "whenever it arrives";
  EXPECT_NEAR(clock.Add(500.2, 7.3), 0.2, kClose_s);
  EXPECT_EQ(clock.num_by_arrival(), 0);
}

TEST(LiveClock, GoesByArrivalWithoutStamps) {
  LiveClock clock;
  EXPECT_NEAR(clock.Add({}, 7), 0, kClose_s);
  EXPECT_NEAR(clock.Add({}, 7.2), 0.2, kClose_s);
  const double in_one_go_s = clock.Add({}, 7.2);
  EXPECT_GT(in_one_go_s, 0.2);
  EXPECT_LT(in_one_go_s, 0.201);
  EXPECT_EQ(clock.num_by_arrival(), 3);
}

TEST(LiveClock, StampsThatStandStillGoBackOrJumpAreNotFollowed) {
  LiveClock clock;
  clock.Add(500.0, 7);
  EXPECT_NEAR(clock.Add(500.0, 7.1), 0.1, kClose_s) << "stands still";
  EXPECT_NEAR(clock.Add(500.1, 7.2), 0.2, kClose_s) << "goes on";
  EXPECT_NEAR(clock.Add(3.0, 7.3), 0.3, kClose_s) << "was set back";
  EXPECT_NEAR(clock.Add(3.1, 7.4), 0.4, kClose_s);
  EXPECT_NEAR(clock.Add(9000, 7.5), 0.5, kClose_s) << "was set forward";
  EXPECT_NEAR(clock.Add(9000.1, 7.6), 0.6, kClose_s);
  EXPECT_NEAR(clock.Add(std::numeric_limits<double>::quiet_NaN(), 7.7), 0.7, kClose_s);
  EXPECT_EQ(clock.num_by_arrival(), 4);
}

TEST(LiveClock, AfterABreakGoesOnAsLongAsItLasted) {
  LiveClock clock;
  clock.Add(500.0, 7);
  clock.Add(500.1, 7.1);
  clock.ForgetStamps();
  EXPECT_NEAR(clock.Add(500.2, 17.1), 10.1, kClose_s)
      << "a new clock, though it looks like the old";
  EXPECT_NEAR(clock.Add(500.3, 17.3), 10.2, kClose_s);
  EXPECT_EQ(clock.num_by_arrival(), 0);
}

}  // namespace
}  // namespace mono3d
