// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "keyframes/reference_spacing.h"

#include <gtest/gtest.h>

#include <vector>

#include "keyframes/posed_views.h"

namespace mono3d {
namespace {

constexpr double kMinBaselineRatio = 0.0875;
constexpr double kMinNewShare = 0.25;

// References before a wall, and what is asked about further views of it.
class SpacedReferences : public testing::Test {
 protected:
  View Make(double place, double rotation_deg = 0) {
    const PosedKeyframe posed = MakeKeyframe(next_id_++, place, rotation_deg);
    poses_.push_back(posed.pose);
    return View(posed.keyframe);
  }
  bool HasLike(const View& view) const { return spacing_.HasLike(view, KeyframePoses(0, poses_)); }
  double NewShare(const View& view) const {
    return spacing_.NewShare(view, KeyframePoses(0, poses_));
  }

  ReferenceSpacing spacing_{kMinBaselineRatio, kMinNewShare};
  std::vector<KeyframePose> poses_;
  std::int64_t next_id_ = 0;
};

TEST_F(SpacedReferences, AViewFromAboutThePlaceOfAnyReferenceIsLikeIt) {
  EXPECT_FALSE(HasLike(Make(0)));
  spacing_.Add(Make(0));
  spacing_.Add(Make(0.5));
  EXPECT_TRUE(HasLike(Make(0.08)));
  EXPECT_FALSE(HasLike(Make(0.1)));
  EXPECT_TRUE(HasLike(Make(0.45)));
}

// 65 degrees are in view.
TEST_F(SpacedReferences, AViewThatIsTurnedAwayIsNotLikeIt) {
  spacing_.Add(Make(0));
  EXPECT_TRUE(HasLike(Make(0, 8)));
  EXPECT_FALSE(HasLike(Make(0, 25)));
}

// 1.28 depths are in view.
TEST_F(SpacedReferences, SharesOfWhatIsNewAddUp) {
  const View view = Make(0.4);
  EXPECT_EQ(NewShare(view), 1);
  spacing_.Add(Make(0));
  EXPECT_NEAR(NewShare(view), 0.4 / 1.28, 0.06);
  spacing_.Add(Make(0.9));
  EXPECT_EQ(NewShare(view), 0);
}

TEST_F(SpacedReferences, WhatADepthMapWasTriedOfInVainIsNew) {
  const View view = Make(0);
  spacing_.Add(view);
  EXPECT_EQ(NewShare(view), 0);
  spacing_.NoteNoDepth(view.id());
  EXPECT_EQ(NewShare(view), 1);
  EXPECT_TRUE(HasLike(view)) << "nor is it tried again";
}

TEST_F(SpacedReferences, AReferenceOfAnotherMapShowsNothing) {
  spacing_.Add(Make(0));
  poses_.back().map_id = 1;
  const View view = Make(0);
  EXPECT_FALSE(HasLike(view));
  EXPECT_EQ(NewShare(view), 1);
}

}  // namespace
}  // namespace mono3d
