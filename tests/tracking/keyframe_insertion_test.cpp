// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/mapping/keyframe_insertion.h"

#include <gtest/gtest.h>

#include <numbers>

namespace mono3d::tracking {
namespace {

Pose InsertionTurn(double degrees) {
  return {RotationExp({0, degrees * std::numbers::pi / 180, 0}), Eigen::Vector3d::Zero()};
}

Pose Shift(double length) {
  return {Eigen::Quaterniond::Identity(), Eigen::Vector3d(length, 0, 0)};
}

// All points tracked, nothing moved.
InsertionEvidence Still() {
  InsertionEvidence evidence;
  evidence.median_depth_su = 1;
  evidence.num_inliers = 100;
  evidence.num_reference_points = 100;
  return evidence;
}

TEST(NeedsKeyframe, NotWhileNothingChanges) { EXPECT_FALSE(NeedsKeyframe(Still(), {})); }

TEST(NeedsKeyframe, BeforeTheNextStepWouldTurnTooFar) {
  InsertionEvidence evidence = Still();
  evidence.T_current_previous = InsertionTurn(1);
  evidence.T_current_last = InsertionTurn(2.9);
  EXPECT_FALSE(NeedsKeyframe(evidence, {}));
  evidence.T_current_last = InsertionTurn(3.1);  // 4.1 with the next frame
  EXPECT_TRUE(NeedsKeyframe(evidence, {}));
}

TEST(NeedsKeyframe, NotForEveryImageWhereEverySecondIsNearEnough) {
  InsertionEvidence evidence = Still();
  evidence.is_last_previous = true;
  evidence.T_current_previous = InsertionTurn(2.3);
  evidence.T_current_last = InsertionTurn(2.3);
  EXPECT_FALSE(NeedsKeyframe(evidence, {}));  // 4.6 with the next frame
  evidence.is_last_previous = false;
  EXPECT_TRUE(NeedsKeyframe(evidence, {}));
  evidence.is_last_previous = true;
  evidence.T_current_previous = InsertionTurn(2.5);
  evidence.T_current_last = InsertionTurn(2.5);
  EXPECT_TRUE(NeedsKeyframe(evidence, {}));  // 5, as much as a bundle may have
}

TEST(NeedsKeyframe, BeforeTheNextStepWouldMoveTooFarAtAnyScale) {
  for (const double scale : {1.0, 1000.0}) {
    InsertionEvidence evidence = Still();
    evidence.median_depth_su = scale;
    evidence.T_current_previous = Shift(0.02 * scale);
    evidence.T_current_last = Shift(0.049 * scale);
    EXPECT_FALSE(NeedsKeyframe(evidence, {}));
    evidence.T_current_last = Shift(0.051 * scale);
    EXPECT_TRUE(NeedsKeyframe(evidence, {}));
  }
}

TEST(NeedsKeyframe, WhenContentIsNewButNotTooCloseBy) {
  InsertionEvidence evidence = Still();
  evidence.num_inliers = 85;
  evidence.T_current_last = Shift(0.019);
  EXPECT_FALSE(NeedsKeyframe(evidence, {}));
  evidence.T_current_last = Shift(0.021);
  EXPECT_TRUE(NeedsKeyframe(evidence, {}));
  evidence.num_inliers = 95;
  EXPECT_FALSE(NeedsKeyframe(evidence, {}));
}

TEST(NeedsKeyframe, AsSoonAsItHelpsAYoungMap) {
  InsertionEvidence evidence = Still();
  evidence.is_young = true;
  evidence.T_current_last = Shift(0.019);
  EXPECT_FALSE(NeedsKeyframe(evidence, {}));
  evidence.T_current_last = Shift(0.021);
  EXPECT_TRUE(NeedsKeyframe(evidence, {}));
}

TEST(NeedsKeyframe, CloserByWhenTrackingNeedsPoints) {
  InsertionEvidence evidence = Still();
  evidence.num_inliers = 40;
  evidence.T_current_last = Shift(0.011);
  EXPECT_TRUE(NeedsKeyframe(evidence, {}));
}

TEST(NeedsKeyframe, WaitsWithABlurredImageForASharperOne) {
  InsertionEvidence evidence = Still();
  evidence.T_current_previous = InsertionTurn(0.5);
  evidence.T_current_last = InsertionTurn(4);
  EXPECT_TRUE(NeedsKeyframe(evidence, {}));
  evidence.is_blurred = true;
  EXPECT_FALSE(NeedsKeyframe(evidence, {}));
  evidence.T_current_last = InsertionTurn(5.6);  // 6.1 with the next frame
  EXPECT_TRUE(NeedsKeyframe(evidence, {}));
  evidence = Still();
  evidence.is_blurred = true;
  evidence.num_inliers = 40;  // tracking does not wait
  evidence.T_current_last = Shift(0.011);
  EXPECT_TRUE(NeedsKeyframe(evidence, {}));
}

TEST(NeedsKeyframe, TakesASharpImageAmongBlurredOnesEarly) {
  InsertionEvidence evidence = Still();
  evidence.T_current_previous = Shift(0.001);
  evidence.T_current_last = Shift(0.06);
  EXPECT_FALSE(NeedsKeyframe(evidence, {}));
  evidence.is_sharp = true;
  EXPECT_TRUE(NeedsKeyframe(evidence, {}));
  evidence.T_current_last = Shift(0.04);
  EXPECT_FALSE(NeedsKeyframe(evidence, {}));
}

TEST(NeedsKeyframe, NeverOnTooFewPoints) {
  InsertionEvidence evidence = Still();
  evidence.num_inliers = 14;
  evidence.T_current_last = Shift(0.5);
  EXPECT_FALSE(NeedsKeyframe(evidence, {}));
}

}  // namespace
}  // namespace mono3d::tracking
