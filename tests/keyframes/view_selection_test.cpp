// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Bundles of other motions than a sideways flight with many images.

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <numbers>
#include <vector>

#include "keyframes/posed_views.h"
#include "mono3d/image/image_bundle.h"

namespace mono3d {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr double kPerDegree = std::numbers::pi / 180;

// Every picture is next to every other that is 10 or 20 degrees away.
TEST(ViewSelection, MakesBundlesOfPhotographsInACircle) {
  std::vector<PosedKeyframe> keyframes;
  for (int i = 0; i < 36; ++i) keyframes.push_back(MakeOnCircle(i, 10 * i));
  const auto bundles = TrackedSelector().Select(keyframes);
  const IdList references = References(bundles);
  EXPECT_GE(references.size(), 30U);
  for (const ImageBundle& bundle : bundles) {
    for (const Pose& pose : bundle.T_ref_cam) EXPECT_LE(pose.RotationAngle(), 31 * kPerDegree);
    if (bundle.reference().id < 3 || bundle.reference().id > 32) continue;
    EXPECT_GE(bundle.keyframes.size(), 4U);
  }
}

TEST(ViewSelection, TakesPhotographsInAnyOrder) {
  std::vector<PosedKeyframe> keyframes;
  for (int i = 0; i < 36; ++i) keyframes.push_back(MakeOnCircle(i, 10 * ((i * 7) % 36)));
  const auto bundles = TrackedSelector().Select(keyframes);
  EXPECT_GE(bundles.size(), 30U);
  for (const ImageBundle& bundle : bundles) EXPECT_GE(bundle.keyframes.size(), 3U);
}

// More photographs than the window of a video holds, neighbours in the picture far apart in the
// list: bundles are made at the end, each of neighbours in the picture, whatever the order.
TEST(ViewSelection, ChoosesAmongAllOfUnorderedPhotographs) {
  constexpr int kNum = 144;
  KeyframeSelectorOptions options;
  options.is_unordered = true;
  TrackedSelector selector(options);
  for (int i = 0; i < kNum; ++i) {
    EXPECT_FALSE(selector.Add(MakeOnCircle(i, 2.5 * ((i * 61) % kNum))));
  }
  const std::vector<ImageBundle> bundles = selector.Finish();
  EXPECT_GE(bundles.size(), 30U);
  for (const ImageBundle& bundle : bundles) {
    EXPECT_EQ(bundle.keyframes.size(), 5U);
    for (const Pose& pose : bundle.T_ref_cam) EXPECT_LE(pose.RotationAngle(), 10.1 * kPerDegree);
  }
}

// Twenty degrees: one on each side, since those at forty degrees look too different.
TEST(ViewSelection, MakesBundlesOfThreeOfPhotographsFarApart) {
  std::vector<PosedKeyframe> keyframes;
  for (int i = 0; i < 18; ++i) keyframes.push_back(MakeOnCircle(i, 20 * i));
  const auto bundles = TrackedSelector().Select(keyframes);
  EXPECT_GE(bundles.size(), 14U);
  for (const ImageBundle& bundle : bundles) {
    EXPECT_EQ(bundle.keyframes.size(), 3U);
    EXPECT_EQ(bundle.reference_index(), 1U);
  }
}

// What the first image shows alone, and the last one, is seen from one side only.
TEST(ViewSelection, MakesOneSidedBundlesWhereThereIsOneSide) {
  KeyframeSelectorOptions options;
  options.min_new_share = 0.15;
  std::vector<PosedKeyframe> keyframes;
  for (int i = 0; i < 3; ++i) keyframes.push_back(MakeKeyframe(i, 0.24 * i));
  const auto bundles = TrackedSelector(options).Select(keyframes);
  IdList references = References(bundles);
  std::ranges::sort(references);
  EXPECT_EQ(references, (IdList{0, 1, 2}));
  for (const ImageBundle& bundle : bundles) {
    ASSERT_EQ(bundle.keyframes.size(), 3U);
    const std::size_t reference = bundle.reference_index();
    EXPECT_EQ(reference, 1U);
    if (bundle.reference().id == 1) continue;
    // The farther one is one side, the nearer one the other.
    EXPECT_GT(bundle.T_ref_cam[0].translation().norm(), bundle.T_ref_cam[2].translation().norm());
  }
}

TEST(ViewSelection, TurnsWithTheCamera) {
  std::vector<PosedKeyframe> keyframes;
  for (int i = 0; i < 60; ++i) {
    const int phase = i % 16;
    keyframes.push_back(MakeKeyframe(i, 0.025 * i, 7.0 * (phase < 8 ? phase : 16 - phase)));
  }
  TrackedSelector selector;
  const auto bundles = selector.Select(keyframes);
  EXPECT_GE(bundles.size(), 12U);
  IdList references = References(bundles);
  std::ranges::sort(references);
  EXPECT_TRUE(std::ranges::adjacent_find(references) == references.end()) << "one twice";
  // What is shared with the reference is a third of the 65 degrees in view at least.
  for (const ImageBundle& bundle : bundles) {
    for (const Pose& pose : bundle.T_ref_cam) EXPECT_LT(pose.RotationAngle(), 46 * kPerDegree);
  }
}

// Looking ahead and 20 degrees down: what comes into view is near and soon out of it again. The
// median depth is some five heights.
TEST(ViewSelection, FollowsWhatIsNewInAForwardFlight) {
  const Eigen::Quaterniond down = RotationExp(Eigen::Vector3d(-20 * kPerDegree, 0, 0));
  std::vector<PosedKeyframe> keyframes;
  for (int i = 0; i < 120; ++i) {
    keyframes.push_back(MakeAboveGround(i, Pose(down, Eigen::Vector3d(0, 0, 0.1 * i)), 1));
  }
  const auto bundles = TrackedSelector().Select(keyframes);
  // 12 heights of flight, and of the ground 1 to 4.6 heights away the nearer half is shown larger
  // by a fifth after half a height.
  EXPECT_GE(bundles.size(), 20U);
  EXPECT_LE(bundles.size(), 60U);
  IdList references = References(bundles);
  std::ranges::sort(references);
  for (std::size_t i = 1; i < references.size(); ++i) {
    EXPECT_LE(references[i] - references[i - 1], 10);
  }
}

TEST(ViewSelection, MakesNothingWithoutParallax) {
  TrackedSelector selector;
  std::vector<PosedKeyframe> keyframes;
  for (int i = 0; i < 100; ++i) keyframes.push_back(MakeKeyframe(i, 0.00001 * i, 0.3 * i));
  EXPECT_TRUE(selector.Select(keyframes).empty());
  EXPECT_THAT(selector->Findings(), AllOf(HasSubstr("100 keyframes"), HasSubstr("baseline 0.0"),
                                          HasSubstr("hardly moved sideways")));
}

TEST(ViewSelection, SaysThatImagesAreTooFarApart) {
  TrackedSelector selector;
  for (int i = 0; i < 4; ++i) EXPECT_FALSE(selector.Add(MakeKeyframe(i, 1.5 * i)));
  EXPECT_TRUE(selector.Finish().empty());
  EXPECT_THAT(selector->Findings(), HasSubstr("the images are too far apart"));
}

// 0.02 is aimed for between neighbours.
TEST(ViewSelection, MakesAWeakBundleAtTheEndWhereThereIsLittleParallax) {
  TrackedSelector selector;
  for (int i = 0; i < 10; ++i) EXPECT_FALSE(selector.Add(MakeKeyframe(i, 0.001 * i)));
  const auto bundles = selector.Finish();
  ASSERT_EQ(bundles.size(), 1U);
  EXPECT_GE(bundles[0].keyframes.size(), 3U);
  EXPECT_THAT(selector->Findings(), HasSubstr("baseline 0.00"));
}

// The same little parallax before a flight with enough of it: nothing weak is made of what the
// flight shows better.
TEST(ViewSelection, MakesNoWeakBundleOfWhatABetterOneShows) {
  std::vector<PosedKeyframe> keyframes;
  for (int i = 0; i < 5; ++i) keyframes.push_back(MakeKeyframe(i, 0.001 * i));
  for (int i = 5; i < 25; ++i) keyframes.push_back(MakeKeyframe(i, 0.03 * (i - 4)));
  for (const ImageBundle& bundle : TrackedSelector().Select(keyframes)) {
    double widest = 0;
    for (const Pose& pose : bundle.T_ref_cam) widest = std::max(widest, pose.translation().norm());
    EXPECT_GE(widest / kMedianDepth_su, 0.04);
  }
}

// Beyond the wall there is another room.
TEST(ViewSelection, DoesNotLookThroughWalls) {
  TrackedSelector selector;
  std::vector<PosedKeyframe> keyframes;
  for (int i = 0; i < 10; ++i) keyframes.push_back(MakeKeyframe(i, 0.05 * i));
  for (int i = 10; i < 20; ++i) {
    // Behind the first cameras' wall and all else alike: its wall is twice as far from the start.
    PosedKeyframe posed = MakeKeyframe(i, 0.05 * (i - 10));
    posed.pose.S_world_kf = Similarity(
        1, Pose(Eigen::Quaterniond::Identity(), posed.pose.T_world_cam().translation() -
                                                    Eigen::Vector3d(0, 0, 0.8 * kMedianDepth_su)));
    keyframes.push_back(posed);
  }
  for (const ImageBundle& bundle : selector.Select(keyframes)) {
    const bool is_first = bundle.reference().id < 10;
    for (const std::int64_t id : Ids(bundle)) EXPECT_EQ(id < 10, is_first);
  }
}

}  // namespace
}  // namespace mono3d
