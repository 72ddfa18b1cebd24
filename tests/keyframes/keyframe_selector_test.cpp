// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/keyframes/keyframe_selector.h"

#include <gmock/gmock.h>

#include <memory>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr double kMedianDepth_su = 3;

// A keyframe and where the tracker has it: a camera that has moved sideways by a share of the depth
// and turned about its vertical axis. Lengths are in units of 1 / `scale`.
struct PosedKeyframe {
  Keyframe keyframe;
  KeyframePose pose;
};

PosedKeyframe MakeKeyframe(std::int64_t id, double baseline_ratio, double rotation_deg = 0,
                           double scale = 1) {
  PosedKeyframe posed;
  posed.keyframe.id = id;
  posed.keyframe.frame.bgr = cv::Mat(4, 6, CV_8UC3, cv::Scalar::all(0));
  const double angle_rad = rotation_deg * std::numbers::pi / 180;
  posed.pose.keyframe_id = id;
  posed.pose.S_world_kf =
      Similarity(1, Pose(RotationExp(Eigen::Vector3d(0, angle_rad, 0)),
                         Eigen::Vector3d(scale * baseline_ratio * kMedianDepth_su, 0, 0)));
  const auto depth_su = static_cast<float>(scale * kMedianDepth_su);
  posed.keyframe.sparse_depths_su = {0.5F * depth_su, depth_su, 2 * depth_su};
  return posed;
}

// A selector beside a tracker: hands each keyframe over with the poses of all.
class TrackedSelector {
 public:
  explicit TrackedSelector(const KeyframeSelectorOptions& options = {})
      : selector_(CreateKeyframeSelector(options)) {}

  std::optional<ImageBundle> Add(const PosedKeyframe& posed) {
    poses_.push_back(posed.pose);
    return selector_->Add(posed.keyframe, KeyframePoses(poses_.size(), poses_));
  }

  // The world of all keyframes so far.
  void Move(const Similarity& S_new_old) {
    for (KeyframePose& pose : poses_) pose.S_world_kf = S_new_old * pose.S_world_kf;
  }
  void SetMap(int map_id) {
    for (KeyframePose& pose : poses_) pose.map_id = map_id;
  }

  KeyframeSelector* operator->() { return selector_.get(); }

 private:
  std::unique_ptr<KeyframeSelector> selector_;
  std::vector<KeyframePose> poses_;
};

std::vector<std::int64_t> Ids(const ImageBundle& bundle) {
  std::vector<std::int64_t> ids;
  for (const Keyframe& keyframe : bundle.keyframes) ids.push_back(keyframe.id);
  return ids;
}

using IdList = std::vector<std::int64_t>;

TEST(KeyframeSelector, MakesABundleOfFiveWithTheReferenceInTheMiddle) {
  TrackedSelector selector;
  for (int i = 0; i < 4; ++i) EXPECT_FALSE(selector.Add(MakeKeyframe(i, 0.05 * i)));
  const auto bundle = selector.Add(MakeKeyframe(4, 0.05 * 4));
  ASSERT_TRUE(bundle);
  EXPECT_EQ(Ids(*bundle), (IdList{0, 1, 2, 3, 4}));
  EXPECT_EQ(bundle->reference().id, 2);
  EXPECT_FALSE(bundle->reference().frame.bgr.empty());
}

// The same flight and the same limits between neighbours, whatever the number.
TEST(KeyframeSelector, MakesBundlesOfThreeToNineImages) {
  for (const int num_images : {3, 5, 7, 9}) {
    KeyframeSelectorOptions options;
    options.num_images = num_images;
    TrackedSelector selector(options);
    for (int i = 0; i + 1 < num_images; ++i) {
      EXPECT_FALSE(selector.Add(MakeKeyframe(i, 0.05 * i, 4.0 * i)));
    }
    const auto bundle =
        selector.Add(MakeKeyframe(num_images - 1, 0.05 * (num_images - 1), 4.0 * (num_images - 1)));
    ASSERT_TRUE(bundle) << num_images;
    EXPECT_EQ(bundle->keyframes.size(), static_cast<std::size_t>(num_images));
    EXPECT_EQ(bundle->keyframes.front().id, 0);
    EXPECT_EQ(bundle->keyframes.back().id, num_images - 1);
    EXPECT_EQ(bundle->reference().id, num_images / 2);
    // A gap that a pair of neighbours may not have cuts the larger bundle as it does the smaller.
    const int beyond = num_images;
    EXPECT_FALSE(selector.Add(MakeKeyframe(beyond, 0.05 * beyond + 0.2, 4.0 * beyond)));
  }
}

TEST(KeyframeSelector, TakesTheWidestStepsThatTheLimitsAllow) {
  TrackedSelector selector;
  std::optional<ImageBundle> first;
  for (int i = 0; i <= 12 && !first; ++i) first = selector.Add(MakeKeyframe(i, 0.03 * i));
  ASSERT_TRUE(first);
  // At 0.03 a step, two steps (0.06) are within 0.0875 and three are not; but the window is only
  // five long when the first chain closes, so it takes the single steps that are there.
  EXPECT_EQ(first->keyframes.size(), kBundleSize);
  std::optional<ImageBundle> last;
  for (int i = static_cast<int>(first->keyframes.back().id) + 1; i < 30; ++i) {
    if (auto bundle = selector.Add(MakeKeyframe(i, 0.03 * i))) last = bundle;
  }
  ASSERT_TRUE(last);
  for (std::size_t i = 1; i < kBundleSize; ++i) {
    EXPECT_EQ(last->keyframes[i].id - last->keyframes[i - 1].id, 2);
  }
}

TEST(KeyframeSelector, NeverUsesAReferenceTwice) {
  TrackedSelector selector;
  IdList references;
  for (int i = 0; i < 40; ++i) {
    if (const auto bundle = selector.Add(MakeKeyframe(i, 0.03 * i))) {
      references.push_back(bundle->reference().id);
    }
  }
  ASSERT_GE(references.size(), 8U);
  for (std::size_t i = 1; i < references.size(); ++i) {
    EXPECT_GE(0.03 * static_cast<double>(references[i] - references[i - 1]), 0.0875);
  }
}

TEST(KeyframeSelector, PassesOverKeyframesWithoutBaseline) {
  TrackedSelector selector;
  for (int i = 0; i < 100; ++i) EXPECT_FALSE(selector.Add(MakeKeyframe(i, 0.0001 * i)));
}

TEST(KeyframeSelector, DoesNotBridgeARotationAboveTheLimit) {
  TrackedSelector selector;
  for (int i = 0; i < 4; ++i) EXPECT_FALSE(selector.Add(MakeKeyframe(i, 0.05 * i)));
  EXPECT_FALSE(selector.Add(MakeKeyframe(4, 0.20, 6)));
  for (int i = 5; i < 8; ++i) EXPECT_FALSE(selector.Add(MakeKeyframe(i, 0.05 * i, 6)));
  const auto bundle = selector.Add(MakeKeyframe(8, 0.40, 6));
  ASSERT_TRUE(bundle);
  EXPECT_EQ(Ids(*bundle), (IdList{4, 5, 6, 7, 8}));
}

// Every step turns by more than the limit, as often as it takes to come back: five images hang
// together nowhere.
TEST(KeyframeSelector, TakesImagesTurnedFurtherOverAGap) {
  TrackedSelector selector;
  std::vector<ImageBundle> bundles;
  for (int i = 0; i < 40; ++i) {
    const int phase = i % 16;
    PosedKeyframe posed = MakeKeyframe(i, 0.025 * i, 7.0 * (phase < 8 ? phase : 16 - phase));
    posed.keyframe.frame.camera = {640, 480, 500, 500, 319.5, 239.5};  // 65 by 51 degrees
    if (const auto bundle = selector.Add(posed)) bundles.push_back(*bundle);
  }
  ASSERT_GE(bundles.size(), 4U);
  std::int64_t last_id = -1;
  for (const ImageBundle& bundle : bundles) {
    EXPECT_GT(bundle.reference().id, last_id);
    last_id = bundle.reference().id;
    // The outermost still show half of what the reference does.
    for (const Pose& pose : bundle.T_ref_cam) EXPECT_LT(pose.RotationAngle(), 26 * M_PI / 180);
  }
}

TEST(KeyframeSelector, StartsAfreshWithANewMap) {
  TrackedSelector selector;
  for (int i = 0; i < 4; ++i) EXPECT_FALSE(selector.Add(MakeKeyframe(i, 0.05 * i)));
  PosedKeyframe other_map = MakeKeyframe(4, 0.20);
  other_map.pose.map_id = 1;
  EXPECT_FALSE(selector.Add(other_map));
}

TEST(KeyframeSelector, IgnoresKeyframesThatCannotBeJudged) {
  TrackedSelector selector;
  for (int i = 0; i < 4; ++i) EXPECT_FALSE(selector.Add(MakeKeyframe(i, 0.05 * i)));
  PosedKeyframe blind = MakeKeyframe(4, 0.20);
  blind.keyframe.sparse_depths_su.clear();
  EXPECT_FALSE(selector.Add(blind));
  EXPECT_TRUE(selector.Add(MakeKeyframe(5, 0.21)));
}

TEST(KeyframeSelector, DoesNotDependOnScale) {
  TrackedSelector small;
  TrackedSelector large;
  for (int i = 0; i < 40; ++i) {
    const auto a = small.Add(MakeKeyframe(i, 0.027 * i, 0.9 * i));
    const auto b = large.Add(MakeKeyframe(i, 0.027 * i, 0.9 * i, 1000));
    ASSERT_EQ(a.has_value(), b.has_value());
    if (a) {
      EXPECT_EQ(Ids(*a), Ids(*b));
    }
  }
}

TEST(KeyframeSelector, PassesOverAKeyframeWithoutAPose) {
  TrackedSelector selector;
  for (int i = 0; i < 4; ++i) EXPECT_FALSE(selector.Add(MakeKeyframe(i, 0.05 * i)));
  EXPECT_FALSE(selector->Add(MakeKeyframe(4, 0.20).keyframe, KeyframePoses()));
  EXPECT_TRUE(selector.Add(MakeKeyframe(5, 0.21)));
}

// The world shrinks to half and moves: the bundle is the one that the moved keyframes make, in the
// reference's own unit, which has not changed.
TEST(KeyframeSelector, TakesWaitingKeyframesWhereTheTrackerHasThemNow) {
  TrackedSelector selector;
  const Pose moved(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 7, 0));
  for (int i = 0; i < 4; ++i) EXPECT_FALSE(selector.Add(MakeKeyframe(i, 0.05 * i)));
  selector.Move(Similarity(0.5, moved));
  PosedKeyframe last = MakeKeyframe(4, 0.05 * 4, 0, 0.5);
  last.pose.S_world_kf = Similarity(1, moved) * last.pose.S_world_kf;
  const auto bundle = selector.Add(last);
  ASSERT_TRUE(bundle);
  EXPECT_EQ(Ids(*bundle), (IdList{0, 1, 2, 3, 4}));
  ASSERT_EQ(bundle->T_ref_cam.size(), kBundleSize);
  for (int i = 0; i < 5; ++i) {
    const Eigen::Vector3d expected(0.05 * (i - 2) * kMedianDepth_su, 0, 0);
    const Pose& T_ref_cam = bundle->T_ref_cam[static_cast<std::size_t>(i)];
    EXPECT_LT((T_ref_cam.translation() - expected).norm(), 1e-9);
  }
  EXPECT_EQ(bundle->reference().sparse_depths_su[1], static_cast<float>(kMedianDepth_su));
}

// Their map was joined with another one while they waited.
TEST(KeyframeSelector, KeepsWaitingKeyframesThatCameToAnotherMapTogether) {
  TrackedSelector selector;
  for (int i = 0; i < 4; ++i) EXPECT_FALSE(selector.Add(MakeKeyframe(i, 0.05 * i)));
  selector.SetMap(3);
  PosedKeyframe last = MakeKeyframe(4, 0.20);
  last.pose.map_id = 3;
  EXPECT_TRUE(selector.Add(last));
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
  options.max_baseline_ratio = 0.01;
  EXPECT_THROW(CreateKeyframeSelector(options), UsageError);
}

// Keyframes that lie 3 % of the depth apart, and how far the last bundle's images do when depth
// maps of wider steps have more holes than surface.
double LastStep(bool adapt_baseline) {
  KeyframeSelectorOptions options;
  options.adapt_baseline = adapt_baseline;
  TrackedSelector selector(options);
  double step = 0;
  for (int i = 0; i < 40; ++i) {
    const auto bundle = selector.Add(MakeKeyframe(i, 0.03 * i));
    if (!bundle) continue;
    const IdList ids = Ids(*bundle);
    step = 0.03 * static_cast<double>(ids[1] - ids[0]);
    const double density = step > 0.05 ? 0.2 : 0.9;
    selector->ReportDepthQuality({bundle->reference().id, density, 0.5 * density});
  }
  return step;
}

TEST(KeyframeSelector, MakesNarrowerBundlesAfterMapsFullOfHoles) {
  EXPECT_NEAR(LastStep(false), 0.06, 1e-9);
  EXPECT_NEAR(LastStep(true), 0.03, 1e-9);
}

TEST(KeyframeSelector, PassesOverWhatItHasNotChosen) {
  TrackedSelector selector;
  for (int i = 0; i < 10; ++i)
    selector->ReportDepthQuality({.reference_id = i, .density = 0, .confidence = 0});
  std::optional<ImageBundle> last;
  for (int i = 0; i < 12; ++i) {
    if (auto bundle = selector.Add(MakeKeyframe(i, 0.03 * i))) last = std::move(bundle);
  }
  ASSERT_TRUE(last);
  EXPECT_EQ(Ids(*last)[1] - Ids(*last)[0], 2);  // as wide as allowed
}

}  // namespace
}  // namespace mono3d
