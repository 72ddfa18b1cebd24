// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/keyframes/keyframe_selector.h"

#include <gmock/gmock.h>

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

// A camera that has moved sideways by a share of the depth and turned about its vertical axis.
Keyframe MakeKeyframe(std::int64_t id, double baseline_ratio, double rotation_deg = 0,
                      double scale = 1) {
  Keyframe keyframe;
  keyframe.id = id;
  keyframe.frame.bgr = cv::Mat(4, 6, CV_8UC3, cv::Scalar::all(0));
  const double angle_rad = rotation_deg * std::numbers::pi / 180;
  keyframe.T_world_cam = Pose(RotationExp(Eigen::Vector3d(0, angle_rad, 0)),
                              Eigen::Vector3d(scale * baseline_ratio * kMedianDepth_su, 0, 0));
  const auto depth_su = static_cast<float>(scale * kMedianDepth_su);
  keyframe.sparse_depths_su = {0.5F * depth_su, depth_su, 2 * depth_su};
  return keyframe;
}

std::vector<std::int64_t> Ids(const ImageBundle& bundle) {
  std::vector<std::int64_t> ids;
  for (const Keyframe& keyframe : bundle.keyframes) ids.push_back(keyframe.id);
  return ids;
}

using IdList = std::vector<std::int64_t>;

TEST(KeyframeSelector, MakesABundleOfFiveWithTheReferenceInTheMiddle) {
  const auto selector = CreateKeyframeSelector();
  for (int i = 0; i < 4; ++i) EXPECT_FALSE(selector->Add(MakeKeyframe(i, 0.05 * i)));
  const auto bundle = selector->Add(MakeKeyframe(4, 0.05 * 4));
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
    const auto selector = CreateKeyframeSelector(options);
    for (int i = 0; i + 1 < num_images; ++i) {
      EXPECT_FALSE(selector->Add(MakeKeyframe(i, 0.05 * i, 4.0 * i)));
    }
    const auto bundle = selector->Add(
        MakeKeyframe(num_images - 1, 0.05 * (num_images - 1), 4.0 * (num_images - 1)));
    ASSERT_TRUE(bundle) << num_images;
    EXPECT_EQ(bundle->keyframes.size(), static_cast<std::size_t>(num_images));
    EXPECT_EQ(bundle->keyframes.front().id, 0);
    EXPECT_EQ(bundle->keyframes.back().id, num_images - 1);
    EXPECT_EQ(bundle->reference().id, num_images / 2);
    // A gap that a pair of neighbours may not have cuts the larger bundle as it does the smaller.
    const int beyond = num_images;
    EXPECT_FALSE(selector->Add(MakeKeyframe(beyond, 0.05 * beyond + 0.2, 4.0 * beyond)));
  }
}

TEST(KeyframeSelector, TakesTheWidestStepsThatTheLimitsAllow) {
  const auto selector = CreateKeyframeSelector();
  std::optional<ImageBundle> first;
  for (int i = 0; i <= 12 && !first; ++i) first = selector->Add(MakeKeyframe(i, 0.03 * i));
  ASSERT_TRUE(first);
  // At 0.03 a step, two steps (0.06) are within 0.0875 and three are not; but the window is only
  // five long when the first chain closes, so it takes the single steps that are there.
  EXPECT_EQ(first->keyframes.size(), kBundleSize);
  std::optional<ImageBundle> last;
  for (int i = static_cast<int>(first->keyframes.back().id) + 1; i < 30; ++i) {
    if (auto bundle = selector->Add(MakeKeyframe(i, 0.03 * i))) last = bundle;
  }
  ASSERT_TRUE(last);
  for (std::size_t i = 1; i < kBundleSize; ++i) {
    EXPECT_EQ(last->keyframes[i].id - last->keyframes[i - 1].id, 2);
  }
}

TEST(KeyframeSelector, NeverUsesAReferenceTwice) {
  const auto selector = CreateKeyframeSelector();
  IdList references;
  for (int i = 0; i < 40; ++i) {
    if (const auto bundle = selector->Add(MakeKeyframe(i, 0.03 * i))) {
      references.push_back(bundle->reference().id);
    }
  }
  ASSERT_GE(references.size(), 8U);
  for (std::size_t i = 1; i < references.size(); ++i) {
    EXPECT_GE(0.03 * static_cast<double>(references[i] - references[i - 1]), 0.0875);
  }
}

TEST(KeyframeSelector, PassesOverKeyframesWithoutBaseline) {
  const auto selector = CreateKeyframeSelector();
  for (int i = 0; i < 100; ++i) EXPECT_FALSE(selector->Add(MakeKeyframe(i, 0.0001 * i)));
}

TEST(KeyframeSelector, DoesNotBridgeARotationAboveTheLimit) {
  const auto selector = CreateKeyframeSelector();
  for (int i = 0; i < 4; ++i) EXPECT_FALSE(selector->Add(MakeKeyframe(i, 0.05 * i)));
  EXPECT_FALSE(selector->Add(MakeKeyframe(4, 0.20, 6)));
  for (int i = 5; i < 8; ++i) EXPECT_FALSE(selector->Add(MakeKeyframe(i, 0.05 * i, 6)));
  const auto bundle = selector->Add(MakeKeyframe(8, 0.40, 6));
  ASSERT_TRUE(bundle);
  EXPECT_EQ(Ids(*bundle), (IdList{4, 5, 6, 7, 8}));
}

TEST(KeyframeSelector, StartsAfreshWithANewMap) {
  const auto selector = CreateKeyframeSelector();
  for (int i = 0; i < 4; ++i) EXPECT_FALSE(selector->Add(MakeKeyframe(i, 0.05 * i)));
  Keyframe other_map = MakeKeyframe(4, 0.20);
  other_map.map_id = 1;
  EXPECT_FALSE(selector->Add(other_map));
}

TEST(KeyframeSelector, IgnoresKeyframesThatCannotBeJudged) {
  const auto selector = CreateKeyframeSelector();
  for (int i = 0; i < 4; ++i) EXPECT_FALSE(selector->Add(MakeKeyframe(i, 0.05 * i)));
  Keyframe blind = MakeKeyframe(4, 0.20);
  blind.sparse_depths_su.clear();
  EXPECT_FALSE(selector->Add(blind));
  EXPECT_TRUE(selector->Add(MakeKeyframe(5, 0.21)));
}

TEST(KeyframeSelector, DoesNotDependOnScale) {
  const auto small = CreateKeyframeSelector();
  const auto large = CreateKeyframeSelector();
  for (int i = 0; i < 40; ++i) {
    const auto a = small->Add(MakeKeyframe(i, 0.027 * i, 0.9 * i));
    const auto b = large->Add(MakeKeyframe(i, 0.027 * i, 0.9 * i, 1000));
    ASSERT_EQ(a.has_value(), b.has_value());
    if (a) {
      EXPECT_EQ(Ids(*a), Ids(*b));
    }
  }
}

// The world shrinks to half and moves: the bundle is the one that the corrected keyframes make.
TEST(KeyframeSelector, MovesWaitingKeyframesWhenTheyAreCorrected) {
  const auto selector = CreateKeyframeSelector();
  std::vector<KeyframeCorrection> corrections;
  const Pose moved(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 7, 0));
  for (int i = 0; i < 4; ++i) {
    EXPECT_FALSE(selector->Add(MakeKeyframe(i, 0.05 * i)));
    corrections.push_back({i, 0, moved * MakeKeyframe(i, 0.05 * i, 0, 0.5).T_world_cam, 0.5});
  }
  corrections.push_back({9, 0, Pose(), 9});  // not one of those that wait
  selector->Correct(corrections);
  Keyframe last = MakeKeyframe(4, 0.05 * 4, 0, 0.5);
  last.T_world_cam = moved * last.T_world_cam;
  const auto bundle = selector->Add(last);
  ASSERT_TRUE(bundle);
  EXPECT_EQ(Ids(*bundle), (IdList{0, 1, 2, 3, 4}));
  EXPECT_NEAR(bundle->reference().T_world_cam.translation().x(), 0.05 * kMedianDepth_su, 1e-9);
  EXPECT_NEAR(bundle->reference().T_world_cam.translation().y(), 7, 1e-9);
  EXPECT_NEAR(bundle->reference().sparse_depths_su[1], 0.5 * kMedianDepth_su, 1e-5);
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
  const auto selector = CreateKeyframeSelector(options);
  double step = 0;
  for (int i = 0; i < 40; ++i) {
    const auto bundle = selector->Add(MakeKeyframe(i, 0.03 * i));
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
  const auto selector = CreateKeyframeSelector();
  for (int i = 0; i < 10; ++i)
    selector->ReportDepthQuality({.reference_id = i, .density = 0, .confidence = 0});
  std::optional<ImageBundle> last;
  for (int i = 0; i < 12; ++i) {
    if (auto bundle = selector->Add(MakeKeyframe(i, 0.03 * i))) last = std::move(bundle);
  }
  ASSERT_TRUE(last);
  EXPECT_EQ(Ids(*last)[1] - Ids(*last)[0], 2);  // as wide as allowed
}

}  // namespace
}  // namespace mono3d
