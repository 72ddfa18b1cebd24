// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/keyframes/keyframe_selector.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "keyframes/posed_views.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using testing::AllOf;
using testing::Each;
using testing::HasSubstr;
using testing::ThrowsMessage;

std::vector<PosedKeyframe> Sideways(int num_keyframes, double step, double rotation_step_deg = 0,
                                    double scale = 1) {
  std::vector<PosedKeyframe> keyframes;
  for (int i = 0; i < num_keyframes; ++i) {
    keyframes.push_back(MakeKeyframe(i, step * i, rotation_step_deg * i, scale));
  }
  return keyframes;
}

TEST(KeyframeSelector, MakesBundlesOfFiveWithTheReferenceInTheMiddle) {
  const auto bundles = TrackedSelector().Select(Sideways(20, 0.05));
  ASSERT_GE(bundles.size(), 6U);
  for (const ImageBundle& bundle : bundles) {
    const std::int64_t id = bundle.reference().id;
    EXPECT_FALSE(bundle.reference().frame.bgr.empty());
    if (id < 2 || id > 17) continue;
    EXPECT_EQ(Ids(bundle), (IdList{id - 2, id - 1, id, id + 1, id + 2}));
    EXPECT_EQ(bundle.reference_index(), 2U);
  }
}

TEST(KeyframeSelector, MakesBundlesOfThreeToNineImages) {
  for (const int num_images : {3, 5, 7, 9}) {
    KeyframeSelectorOptions options;
    options.num_images = num_images;
    const auto bundles = TrackedSelector(options).Select(Sideways(30, 0.03));
    ASSERT_FALSE(bundles.empty());
    for (const ImageBundle& bundle : bundles) {
      const std::int64_t id = bundle.reference().id;
      if (id < 10 || id > 19) continue;
      EXPECT_EQ(bundle.keyframes.size(), static_cast<std::size_t>(num_images));
      EXPECT_EQ(bundle.reference_index(), static_cast<std::size_t>(num_images / 2));
    }
  }
}

// 1 % of the depth a step: 0.6 degrees.
TEST(KeyframeSelector, AimsAtTheBestAngleBetweenNeighbours) {
  const auto bundles = TrackedSelector().Select(Sideways(100, 0.01));
  int num_checked = 0;
  for (const ImageBundle& bundle : bundles) {
    const std::int64_t id = bundle.reference().id;
    if (id < 20 || id > 75) continue;
    const IdList ids = Ids(bundle);
    ASSERT_EQ(ids.size(), kBundleSize);
    // The median point of the wall is seen under 0.85 of the angle of the point straight ahead.
    for (std::size_t i = 1; i < kBundleSize; ++i)
      EXPECT_NEAR(static_cast<double>(ids[i] - ids[i - 1]), 6, 2);
    ++num_checked;
  }
  EXPECT_GE(num_checked, 4);
}

TEST(KeyframeSelector, SpacesReferencesByTheirBaseline) {
  const IdList references = References(TrackedSelector().Select(Sideways(40, 0.03)));
  ASSERT_GE(references.size(), 8U);
  for (std::size_t i = 1; i < references.size(); ++i) {
    EXPECT_GE(0.03 * static_cast<double>(references[i] - references[i - 1]), 0.0875);
  }
}

// The way back over the same wall shows nothing new.
TEST(KeyframeSelector, MakesNoSecondBundleOfOnePlace) {
  std::vector<PosedKeyframe> keyframes = Sideways(20, 0.05);
  for (int i = 20; i < 40; ++i) keyframes.push_back(MakeKeyframe(i, 0.05 * (39 - i)));
  const IdList references = References(TrackedSelector().Select(keyframes));
  EXPECT_GE(references.size(), 8U);
  EXPECT_LE(*std::max_element(references.begin(), references.end()), 21);
}

TEST(KeyframeSelector, KeepsMapsApart) {
  TrackedSelector selector;
  std::vector<PosedKeyframe> keyframes = Sideways(20, 0.05);
  for (int i = 10; i < 20; ++i) keyframes[static_cast<std::size_t>(i)].pose.map_id = 1;
  const auto bundles = selector.Select(keyframes);
  EXPECT_GE(bundles.size(), 6U);
  for (const ImageBundle& bundle : bundles) {
    const bool is_first = bundle.reference().id < 10;
    for (const std::int64_t id : Ids(bundle)) EXPECT_EQ(id < 10, is_first);
  }
}

TEST(KeyframeSelector, PassesOverKeyframesThatCannotBeJudged) {
  TrackedSelector selector;
  std::vector<PosedKeyframe> keyframes = Sideways(12, 0.05);
  keyframes[5].keyframe.sparse_depths_su.clear();
  keyframes[5].keyframe.sparse_pixels.clear();
  const auto bundles = selector.Select(keyframes);
  EXPECT_GE(bundles.size(), 3U);
  for (const ImageBundle& bundle : bundles) {
    EXPECT_THAT(Ids(bundle), Each(testing::Ne(5)));
  }
}

TEST(KeyframeSelector, PassesOverKeyframesWithoutAPose) {
  TrackedSelector selector;
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(selector.Add(MakeKeyframe(i, 0.05 * i)));
  EXPECT_FALSE(selector->Add(MakeKeyframe(100, 0.15).keyframe, selector.Poses()));
  std::vector<ImageBundle> bundles;
  for (int i = 3; i < 12; ++i) {
    if (auto bundle = selector.Add(MakeKeyframe(i, 0.05 * i))) bundles.push_back(*bundle);
  }
  EXPECT_GE(bundles.size(), 3U);
  for (const ImageBundle& bundle : bundles) EXPECT_THAT(Ids(bundle), Each(testing::Lt(12)));
}

TEST(KeyframeSelector, DoesNotDependOnScale) {
  TrackedSelector small;
  TrackedSelector large;
  const auto a = small.Select(Sideways(40, 0.027, 0.9));
  const auto b = large.Select(Sideways(40, 0.027, 0.9, 1024));
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(Ids(a[i]), Ids(b[i]));
}

TEST(KeyframeSelector, DoesNotDependOnTime) {
  std::vector<PosedKeyframe> slow = Sideways(30, 0.03);
  for (PosedKeyframe& posed : slow) {
    posed.keyframe.frame.timestamp_s = 9 * static_cast<double>(posed.keyframe.id % 7);
    posed.keyframe.frame.index = 100 - posed.keyframe.id;
  }
  const auto a = TrackedSelector().Select(Sideways(30, 0.03));
  const auto b = TrackedSelector().Select(slow);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(Ids(a[i]), Ids(b[i]));
}

// The world shrinks to half and moves: the bundle is the one that the moved keyframes make, in the
// reference's own unit, which has not changed.
TEST(KeyframeSelector, TakesWaitingKeyframesWhereTheTrackerHasThemNow) {
  TrackedSelector selector;
  const Pose moved(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 7, 0));
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(selector.Add(MakeKeyframe(i, 0.05 * i)));
  selector.Move(Similarity(0.5, moved));
  std::vector<PosedKeyframe> rest;
  for (int i = 3; i < 8; ++i) {
    rest.push_back(MakeKeyframe(i, 0.05 * i, 0, 0.5));
    rest.back().pose.S_world_kf = Similarity(1, moved) * rest.back().pose.S_world_kf;
  }
  const auto bundles = selector.Select(rest);
  ASSERT_FALSE(bundles.empty());
  const ImageBundle& bundle = bundles.front();
  const std::int64_t reference = bundle.reference().id;
  ASSERT_LT(reference, 3);
  ASSERT_GE(Ids(bundle).back(), 3);
  for (std::size_t i = 0; i < bundle.keyframes.size(); ++i) {
    const auto steps = static_cast<double>(bundle.keyframes[i].id - reference);
    const Eigen::Vector3d expected(0.05 * steps * kMedianDepth_su, 0, 0);
    EXPECT_LT((bundle.T_ref_cam[i].translation() - expected).norm(), 1e-9);
  }
}

// Their map was joined with another one while they waited.
TEST(KeyframeSelector, KeepsWaitingKeyframesThatCameToAnotherMapTogether) {
  TrackedSelector selector;
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(selector.Add(MakeKeyframe(i, 0.05 * i)));
  selector.SetMap(3);
  std::vector<PosedKeyframe> rest;
  for (int i = 3; i < 6; ++i) {
    rest.push_back(MakeKeyframe(i, 0.05 * i));
    rest.back().pose.map_id = 3;
  }
  const auto bundles = selector.Select(rest);
  ASSERT_FALSE(bundles.empty());
  EXPECT_LT(bundles.front().reference().id, 3);
}

// Of two hundred keyframes no more than forty are held.
TEST(KeyframeSelector, HoldsABoundedNumberOfImages) {
  TrackedSelector selector;
  std::vector<cv::Mat> images;
  for (int i = 0; i < 200; ++i) {
    PosedKeyframe posed = MakeKeyframe(i, 0.05 * i);
    images.push_back(posed.keyframe.frame.bgr);
    (void)selector.Add(posed);
  }
  const auto is_held = [](const cv::Mat& image) { return image.u->refcount > 1; };
  EXPECT_LE(std::count_if(images.begin(), images.end(), is_held), 40);
}

TEST(KeyframeSelectorOptions, RefusesANumberOfImagesThatIsNotThreeFiveSevenOrNine) {
  for (const int num_images : {-1, 0, 1, 2, 4, 6, 8, 10, 11}) {
    KeyframeSelectorOptions options;
    options.num_images = num_images;
    EXPECT_THAT([&] { (void)CreateKeyframeSelector(options); },
                ThrowsMessage<UsageError>(AllOf(HasSubstr("keyframes.num_images"),
                                                HasSubstr("3, 5, 7 or 9"),
                                                HasSubstr("found " + std::to_string(num_images)))));
  }
}

TEST(KeyframeSelectorOptions, RefusesLimitsThatContradictEachOther) {
  KeyframeSelectorOptions options;
  options.max_angle_deg = 2;
  EXPECT_THROW(CreateKeyframeSelector(options), UsageError);
}

// Keyframes that lie 1 % of the depth apart, and how far the last bundle's images do when depth
// maps of wider steps have more holes than surface.
double LastStep(bool adapt_baseline) {
  KeyframeSelectorOptions options;
  options.adapt_baseline = adapt_baseline;
  TrackedSelector selector(options);
  double step = 0;
  for (int i = 0; i < 150; ++i) {
    const auto bundle = selector.Add(MakeKeyframe(i, 0.01 * i));
    if (!bundle) continue;
    const IdList ids = Ids(*bundle);
    step = 0.01 * static_cast<double>(ids.back() - ids.front()) / 4;
    const double density = step > 0.04 ? 0.2 : 0.9;
    selector->ReportDepthQuality({bundle->reference().id, density, 0.5 * density});
  }
  return step;
}

TEST(KeyframeSelector, MakesNarrowerBundlesAfterMapsFullOfHoles) {
  EXPECT_NEAR(LastStep(false), 0.06, 0.011);
  EXPECT_NEAR(LastStep(true), 0.03, 0.011);
}

TEST(KeyframeSelector, PassesOverWhatItHasNotChosen) {
  TrackedSelector selector;
  for (int i = 0; i < 10; ++i)
    selector->ReportDepthQuality({.reference_id = i, .density = 0, .confidence = 0});
  const auto a = selector.Select(Sideways(20, 0.05));
  const auto b = TrackedSelector().Select(Sideways(20, 0.05));
  EXPECT_EQ(References(a), References(b));
}

}  // namespace
}  // namespace mono3d
