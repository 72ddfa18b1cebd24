// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "keyframes/source_choice.h"

#include <gmock/gmock.h>

#include <array>
#include <numbers>
#include <vector>

#include "keyframes/posed_views.h"

namespace mono3d {
namespace {

using testing::ElementsAre;

CommonView CommonWith(double angle_deg) {
  CommonView common;
  common.share = 1;
  common.angle_deg = angle_deg;
  common.baseline_ratio = 0.05;
  common.angles_deg = {angle_deg};
  return common;
}

TEST(SourceWeight, IsLargestAtTheAngleAskedFor) {
  EXPECT_NEAR(SourceWeight(CommonWith(5), 5), 1, 1e-12);
  EXPECT_NEAR(SourceWeight(CommonWith(10), 5), SourceWeight(CommonWith(2.5), 5), 1e-12);
  EXPECT_LT(SourceWeight(CommonWith(10), 5), 0.7);
  EXPECT_GT(SourceWeight(CommonWith(10), 5), SourceWeight(CommonWith(20), 5));
  EXPECT_GT(SourceWeight(CommonWith(20), 5), 0);
}

TEST(SourceWeight, FallsWithWhatIsNotSharedAndWithUnlikePictures) {
  CommonView half = CommonWith(5);
  half.share = 0.5;
  EXPECT_NEAR(SourceWeight(half, 5), 0.5, 1e-12);
  CommonView small = CommonWith(5);
  small.scale = 0.6;
  CommonView large = CommonWith(5);
  large.scale = 1 / 0.6;
  EXPECT_LT(SourceWeight(small, 5), 0.6);
  EXPECT_NEAR(SourceWeight(small, 5), SourceWeight(large, 5), 1e-12);
  CommonView rolled = CommonWith(5);
  rolled.roll_deg = 20;
  EXPECT_LT(SourceWeight(rolled, 5), 0.6);
}

TEST(SourceWeight, PicturesThatCannotBeMatchedAreNotUsable) {
  EXPECT_TRUE(IsUsable(CommonWith(5), 30));
  EXPECT_FALSE(IsUsable(CommonWith(31), 30));
  CommonView rolled = CommonWith(5);
  rolled.roll_deg = 90;
  EXPECT_FALSE(IsUsable(rolled, 30));
  CommonView small = CommonWith(5);
  small.scale = 0.4;
  EXPECT_FALSE(IsUsable(small, 30));
  CommonView apart = CommonWith(5);
  apart.share = 0.1;
  EXPECT_FALSE(IsUsable(apart, 30));
  CommonView close = CommonWith(5);
  close.baseline_ratio = 0.0001;
  EXPECT_FALSE(IsUsable(close, 30));
}

// Views before a wall, at shares of its depth to the side.
struct Wall {
  explicit Wall(const std::vector<double>& places) {
    std::int64_t id = 0;
    for (const double place : places) {
      const PosedKeyframe posed = MakeKeyframe(id++, place);
      views.emplace_back(posed.keyframe);
      poses.push_back(posed.pose);
    }
  }

  std::optional<SourceChoice> Choose(std::size_t reference) const {
    std::vector<const View*> pointers;
    for (const View& view : views) pointers.push_back(&view);
    return ChooseSources(pointers, reference, KeyframePoses(0, poses), {});
  }

  std::vector<View> views;
  std::vector<KeyframePose> poses;
};

TEST(ChooseSources, ClimbsInAnglesOnBothSides) {
  const Wall wall({-0.3, -0.13, -0.06, 0, 0.06, 0.07, 0.13, 0.3});
  const auto choice = wall.Choose(3);
  ASSERT_TRUE(choice);
  EXPECT_EQ(choice->grade, SourceGrade::kGood);
  EXPECT_THAT(choice->first, ElementsAre(1, 2));
  EXPECT_THAT(choice->second, ElementsAre(4, 6));
  EXPECT_NEAR(choice->baseline_ratio, 0.13, 1e-9);
}

// Cameras held across and upside down see the same; what is turned in between does not match. A
// rotation is the same whichever sign its quaternion has.
TEST(Compare, CountsTheTurnBeyondWholeQuarters) {
  const auto roll_between = [](double reference_deg, double other_deg) {
    const PosedKeyframe reference = MakeRolled(0, 0, reference_deg);
    const PosedKeyframe other = MakeRolled(1, 0.05, other_deg);
    const std::vector<KeyframePose> poses = {reference.pose, other.pose};
    return Compare(View(reference.keyframe), View(other.keyframe), KeyframePoses(0, poses))
        .roll_deg;
  };
  EXPECT_NEAR(roll_between(0, 0), 0, 1e-6);
  EXPECT_NEAR(roll_between(0, 90), 0, 1e-6);
  EXPECT_NEAR(roll_between(0, 180), 0, 1e-6);
  EXPECT_NEAR(roll_between(0, -90), 0, 1e-6);
  EXPECT_NEAR(roll_between(0, 20), 20, 1e-6);
  EXPECT_NEAR(roll_between(20, 170), 30, 1e-6);
  EXPECT_NEAR(roll_between(10, -125), 45, 1e-6);
  EXPECT_NEAR(roll_between(-170, 175), 15, 1e-6);  // 345 degrees by the sign of the quaternion
}

TEST(ChooseSources, TakesFewerWhereThereAreFewer) {
  const auto choice = Wall({-0.06, 0, 0.06, 0.13}).Choose(1);
  ASSERT_TRUE(choice);
  EXPECT_EQ(choice->grade, SourceGrade::kGood);
  EXPECT_THAT(choice->first, ElementsAre(0));
  EXPECT_THAT(choice->second, ElementsAre(2, 3));
}

TEST(ChooseSources, PutsTheNearerOnesOnASideOfTheirOwnWhereAllAreOnOne) {
  const auto choice = Wall({0, 0.03, 0.06, 0.09, 0.12}).Choose(0);
  ASSERT_TRUE(choice);
  EXPECT_EQ(choice->grade, SourceGrade::kOneSided);
  EXPECT_THAT(choice->second, ElementsAre(1, 2));
  EXPECT_THAT(choice->first, ElementsAre(3, 4));
}

TEST(ChooseSources, LittleBaselineIsWeak) {
  const auto choice = Wall({-0.008, -0.004, 0, 0.004, 0.008}).Choose(2);
  ASSERT_TRUE(choice);
  EXPECT_EQ(choice->grade, SourceGrade::kWeak);
  EXPECT_NEAR(choice->baseline_ratio, 0.008, 1e-9);
}

TEST(ChooseSources, NeedsTwo) {
  EXPECT_FALSE(Wall({0, 0.05}).Choose(0));
  EXPECT_FALSE(Wall({0, 0.05, 3}).Choose(0));
}

TEST(ChooseSources, OfEqualOnesTheNearestInTheListIsTaken) {
  const auto choice = Wall({0.05, 0.05, -0.05, 0, 0.05, 0.05, 0.1, 0.1}).Choose(3);
  ASSERT_TRUE(choice);
  EXPECT_THAT(choice->second, ElementsAre(4, 6));
}

}  // namespace
}  // namespace mono3d
