// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include <cmath>

#include "fusion/export.h"
#include "fusion/fusion_scene.h"
#include "fusion/registration_scene.h"
#include "mono3d/fusion/surfel_map.h"

namespace mono3d {
namespace {

// Maps of noise in random colours: there is nothing to register.
SurfelMapOptions InferredUnregistered() {
  SurfelMapOptions options;
  options.registration.enabled = false;
  return options;
}

constexpr int kInferredWidth = 96;
constexpr int kInferredHeight = 64;
const cv::Rect kGuess(30, 20, 30, 16);

// A wall 10 su away. In the middle of it nothing is matched; that is inferred to be so far away.
TrackedMap GuessingMap(unsigned seed, float guess_depth = 10) {
  TrackedMap map = PlaneMap(TestCamera(kInferredWidth, kInferredHeight), Pose());
  Disturb(map, 0.001, 0, seed);
  map.depth(kGuess).setTo(guess_depth);
  map.confidence = cv::Mat(kInferredHeight, kInferredWidth, CV_32FC1, cv::Scalar(0.75));
  map.confidence(kGuess).setTo(0.125);
  map.inferred = cv::Mat::zeros(kInferredHeight, kInferredWidth, CV_8UC1);
  map.inferred(kGuess).setTo(255);
  return map;
}

// The same without what is inferred, or with all of it matched.
TrackedMap Matching(TrackedMap map, bool everywhere) {
  if (!everywhere) map.depth.setTo(0, map.inferred);
  map.confidence.setTo(0.75);
  map.inferred.release();
  return map;
}

std::size_t NumInferred(const PointCloud& cloud) { return InferredPoints(cloud).size(); }

TEST(Inferred, IsExportedMarkedWhereTwoDepthMapsAgree) {
  const auto model = CreateTrackedModel(InferredUnregistered());
  const FusionResult first = model->Integrate(GuessingMap(1));
  EXPECT_EQ(first.num_inferred, kGuess.area());
  EXPECT_EQ(first.num_inserted, kInferredWidth * kInferredHeight - kGuess.area());
  EXPECT_EQ(NumInferred(model->Export(SurfelExportOptions{})), 0U);
  EXPECT_EQ(NumInferred(model->Export(1)), static_cast<std::size_t>(kGuess.area()));
  EXPECT_EQ(model->Integrate(GuessingMap(2)).num_inferred, kGuess.area());
  const PointCloud cloud = model->Export(SurfelExportOptions{});
  // Those beside matched pixels are in the place of these.
  EXPECT_GE(NumInferred(cloud), static_cast<std::size_t>((kGuess.width - 2) * (kGuess.height - 2)));
  EXPECT_LE(NumInferred(cloud), static_cast<std::size_t>(kGuess.area()));
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const bool is_near = std::abs(cloud.points[i].z() - 10) < 0.02F;
    ASSERT_TRUE(is_near || !IsInferred(cloud, i)) << i;
  }
  EXPECT_TRUE(model->Export(SurfelExportOptions{.with_inferred = false}).inferred.empty());
}

// Known to 1.6 percent, so that one is enough where nothing else is.
TEST(Inferred, FillsGapsAtOnceWhereItWasMatchedOnACoarserLevel) {
  const auto map_of = [](unsigned seed, std::uint8_t kind) {
    TrackedMap map = GuessingMap(seed);
    map.confidence(kGuess).setTo(0.0625);
    map.inferred(kGuess).setTo(kind);
    return map;
  };
  // In the middle of the gap, in which nothing is near what was matched.
  const auto num_in_gap = [](const PointCloud& cloud) {
    EXPECT_EQ(NumInferred(cloud), 0U);
    return std::ranges::count_if(cloud.confidences, [](float c) { return c < 0.14F; });
  };
  const auto num_after = [&](std::uint8_t first, std::uint8_t second) {
    const auto model = CreateTrackedModel(InferredUnregistered());
    model->Integrate(map_of(1, first));
    if (second != 0) model->Integrate(map_of(2, second));
    return num_in_gap(model->Export(SurfelExportOptions{}));
  };
  const int num_at_least = (kGuess.width - 6) * (kGuess.height - 6);
  EXPECT_EQ(num_after(kInferred, 0), 0);
  EXPECT_GE(num_after(kCoarselyMatched, 0), num_at_least);
  EXPECT_EQ(num_after(kInferred, kInferred), 0);
  EXPECT_GE(num_after(kInferred, kCoarselyMatched), num_at_least);
  EXPECT_GE(num_after(kCoarselyMatched, kInferred), num_at_least);
  const auto model = CreateTrackedModel(InferredUnregistered());
  model->Integrate(map_of(1, kCoarselyMatched));
  EXPECT_EQ(num_in_gap(model->Export(SurfelExportOptions{.gap_confidence = 1})), 0);
  // It was matched, after all.
  EXPECT_GE(num_in_gap(model->Export(SurfelExportOptions{.with_inferred = false})), num_at_least);
}

TEST(Inferred, ChangesNothingThatIsMatched) {
  SurfelMapOptions options;
  const auto with = CreateTrackedModel(options);
  const auto without = CreateTrackedModel(options);
  for (int i = 0; i < 4; ++i) {
    TrackedMap map = HouseView({}, 4.0 * i);
    map.keyframe_id = map.frame_index = i;
    map.inferred = cv::Mat::zeros(map.depth.size(), CV_8UC1);
    map.inferred.colRange(10, 60).setTo(255);
    // A guess far before the house: it would hide all of it, and draw registration to it.
    map.depth.colRange(10, 60).setTo(i < 2 ? 3.0F : 4.0F);
    TrackedMap matched = map;
    matched.depth = map.depth.clone();
    matched.depth.setTo(0, map.inferred);
    matched.inferred.release();
    const FusionResult a = with->Integrate(map);
    const FusionResult b = without->Integrate(matched);
    EXPECT_GT(a.num_inferred, 0);
    EXPECT_EQ(b.num_inferred, 0);
    EXPECT_EQ(a.num_inserted, b.num_inserted);
    EXPECT_EQ(a.num_removed, b.num_removed);
    EXPECT_EQ(a.registration.agreement, b.registration.agreement);
    EXPECT_EQ(a.registration.contradiction, b.registration.contradiction);
    EXPECT_EQ(a.S_world_kf.pose().translation(), b.S_world_kf.pose().translation());
    EXPECT_EQ(a.exposure_gain, b.exposure_gain);
  }
  const PointCloud all = with->Export(1);
  const PointCloud expected = without->Export(1);
  EXPECT_GT(NumInferred(all), 0U);
  EXPECT_EQ(with->num_surfels(), without->num_surfels());
  const PointCloud matched = MatchedPoints(all);
  EXPECT_EQ(matched.points, expected.points);
  EXPECT_EQ(matched.colours, expected.colours);
  EXPECT_EQ(matched.confidences, expected.confidences);
}

TEST(Inferred, GivesWayToWhatIsMatchedThere) {
  const auto model = CreateTrackedModel(InferredUnregistered());
  (void)model->Integrate(GuessingMap(1));
  (void)model->Integrate(Matching(GuessingMap(2), true));
  EXPECT_EQ(NumInferred(model->Export(1)), 0U);
  // But for those along its outline, which surfels beside them cover.
  EXPECT_GE(model->num_surfels(),
            kInferredWidth * kInferredHeight - 2 * (kGuess.width + kGuess.height));
}

TEST(Inferred, IsNotTakenUpWhereSomethingIsMatchedInSight) {
  for (const float guess_depth : {5.0F, 10.0F, 20.0F}) {
    const auto model = CreateTrackedModel(InferredUnregistered());
    (void)model->Integrate(Matching(GuessingMap(1), true));
    EXPECT_EQ(model->Integrate(GuessingMap(2, guess_depth)).num_inferred, 0) << guess_depth;
    EXPECT_EQ(model->Integrate(GuessingMap(3, guess_depth)).num_removed, 0) << guess_depth;
    EXPECT_EQ(model->num_surfels(), kInferredWidth * kInferredHeight) << guess_depth;
  }
}

TEST(Inferred, IsRemovedWhereAMatchSeesThroughIt) {
  const auto model = CreateTrackedModel(InferredUnregistered());
  (void)model->Integrate(GuessingMap(1, 5));
  EXPECT_EQ(NumInferred(model->Export(1)), static_cast<std::size_t>(kGuess.area()));
  (void)model->Integrate(Matching(GuessingMap(2), true));
  EXPECT_EQ(NumInferred(model->Export(1)), 0U);
}

TEST(Inferred, IsPartOfWhatAViewerIsGiven) {
  const auto model = CreateTrackedModel(InferredUnregistered());
  (void)model->Integrate(GuessingMap(1));
  const auto num_inferred = [](const SurfelChanges& changes) {
    std::size_t count = 0;
    for (const SurfelChunk& chunk : changes.changed) count += NumInferred(*chunk.surfels);
    return count;
  };
  const SurfelChanges before = model->model().ChangesSince(0);
  EXPECT_EQ(num_inferred(before), static_cast<std::size_t>(kGuess.area()));
  (void)model->Integrate(Matching(GuessingMap(2), true));
  const SurfelChanges after = model->model().ChangesSince(before.version);
  EXPECT_EQ(after.changed.size(), 2U);
  EXPECT_EQ(num_inferred(after), 0U);
}

TEST(Inferred, CountsNoMoreThanFourGuesses) {
  Surfels surfels;
  for (const std::uint32_t observations : {4U, 12U}) {
    surfels.position_radius.push_back({0, 0, 1, 0.1F});
    surfels.normal_weight.push_back({0, 0, -1, 10});
    surfels.history.push_back({0, observations, 0, (observations * 16) << 16});  // 1/16 each
  }
  const std::vector<Similarity> at_the_origin(1);
  const PointCloud cloud = ToPointCloud({}, surfels, at_the_origin, std::vector<std::uint32_t>{3},
                                        {.min_confidence = 0});
  ASSERT_EQ(cloud.size(), 2U);
  EXPECT_FLOAT_EQ(cloud.confidences[0], 0.25F / 1.25F);
  EXPECT_FLOAT_EQ(cloud.confidences[1], 0.25F / 1.25F);
  EXPECT_EQ(cloud.first_frames, std::vector<std::uint32_t>(2, 3));
}

}  // namespace
}  // namespace mono3d
