// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/anchor_map.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fusion/fusion_scene.h"
#include "fusion/overlap_views.h"

namespace mono3d {
namespace {

using Eigen::Vector3d;

constexpr double kRounding = 1e-9;

Similarity At(double x_su) {
  return {1, Pose(Eigen::Quaterniond::Identity(), Vector3d(x_su, 0, 0))};
}

// Of a flight along x over ground 10 su away.
Anchor AnchorAt(int i) {
  Anchor anchor;
  anchor.keyframe_id = 10 * i;
  anchor.frame_index = i;
  anchor.camera = TestCamera(96, 64);
  anchor.S_tracker_kf = At(2.0 * i);
  anchor.median_depth_su = 10;
  return anchor;
}

// One anchor every 2 su, where the tracker has them.
AnchorMap Flight(int num_anchors) {
  AnchorMap anchors;
  for (int i = 0; i < num_anchors; ++i) anchors.Add(AnchorAt(i), AnchorAt(i).S_tracker_kf, 0);
  return anchors;
}

// The poses of a tracker that has found its world to be `motion` of what it was, at each anchor.
template <typename MotionOf>
std::vector<KeyframePose> MovedPoses(const AnchorMap& anchors, MotionOf&& motion_of) {
  std::vector<KeyframePose> poses;
  for (std::uint32_t i = 0; i < anchors.size(); ++i) {
    const Anchor& anchor = anchors.anchor(i);
    poses.push_back({anchor.keyframe_id, 0, motion_of(i) * anchor.S_tracker_kf});
  }
  return poses;
}

bool Update(AnchorMap& anchors, const std::vector<KeyframePose>& poses) {
  return anchors.Update(KeyframePoses(1, poses), 0);
}

// 5 degrees and 3 % of scale, spread over the flight.
Similarity PartOfALoop(double share) {
  return {std::exp(0.03 * share),
          Pose(RotationExp(share * 5 * M_PI / 180 * Vector3d(0.2, -0.4, 0.9).normalized()),
               share * Vector3d(0.5, 0.3, -0.2))};
}

void ExpectNear(const Similarity& a, const Similarity& b) {
  EXPECT_NEAR(a.scale(), b.scale(), kRounding);
  EXPECT_LT((a.pose().translation() - b.pose().translation()).norm(), kRounding);
  EXPECT_LT((a.pose().rotation().inverse() * b.pose().rotation()).vec().norm(), kRounding);
}

TEST(AnchorMap, GoesWhereTheTrackerHasItsKeyframes) {
  AnchorMap anchors = Flight(5);
  const auto poses = MovedPoses(anchors, [](std::uint32_t i) { return PartOfALoop(0.25 * i); });
  EXPECT_TRUE(Update(anchors, poses));
  for (std::uint32_t i = 0; i < 5; ++i) ExpectNear(anchors.S_world_kf()[i], poses[i].S_world_kf);
  EXPECT_FALSE(Update(anchors, poses));  // once
}

// Local adjustments by parts of a pixel are followed, but are no news.
TEST(AnchorMap, TellsOfMotionsThatCanBeNoticed) {
  AnchorMap anchors = Flight(6);
  const auto turned = [&](double angle_px) {
    const double angle_rad = angle_px / AnchorAt(0).camera.fx;
    return MovedPoses(Flight(6), [=](std::uint32_t i) {
      return i != 2 ? Similarity() : Similarity(1, Pose(RotationExp({0, 0, angle_rad}), {0, 0, 0}));
    });
  };
  EXPECT_FALSE(Update(anchors, turned(0.02)));
  ExpectNear(anchors.S_world_kf()[2], turned(0.02)[2].S_world_kf);
  EXPECT_TRUE(Update(anchors, turned(2)));
}

TEST(AnchorMap, AnchorsWithoutAPoseMoveWithTheirNeighbour) {
  AnchorMap anchors = Flight(4);
  const auto motion_of = [](std::uint32_t i) { return PartOfALoop(0.25 * i); };
  auto poses = MovedPoses(anchors, motion_of);
  poses.erase(poses.begin() + 2);
  poses.erase(poses.begin());
  EXPECT_TRUE(Update(anchors, poses));
  ExpectNear(anchors.S_world_kf()[0], motion_of(1) * At(0));
  ExpectNear(anchors.S_world_kf()[1], motion_of(1) * At(2));
  ExpectNear(anchors.S_world_kf()[2], motion_of(1) * At(4));
  ExpectNear(anchors.S_world_kf()[3], motion_of(3) * At(6));
  EXPECT_FALSE(Update(anchors, {}));
}

// The model has the last three elsewhere than the tracker.
AnchorMap WithMovedAnchors(const Similarity& offset) {
  AnchorMap anchors;
  for (int i = 0; i < 6; ++i) {
    const Similarity S = AnchorAt(i).S_tracker_kf;
    anchors.Add(AnchorAt(i), i < 3 ? S : offset * S, 0);
  }
  return anchors;
}

TEST(AnchorMap, KeepsWhatTheModelKnowsBetter) {
  const Similarity offset = PartOfALoop(0.3);
  AnchorMap anchors = WithMovedAnchors(offset);
  // The tracker's whole world moves: another gauge.
  const Similarity gauge(2, Pose(RotationExp({0.3, 1.0, -0.5}), Vector3d(40, -7, 3)));
  EXPECT_TRUE(Update(anchors, MovedPoses(anchors, [&](std::uint32_t) { return gauge; })));
  ExpectNear(anchors.S_world_kf()[1], gauge * At(2));
  ExpectNear(anchors.S_world_kf()[5], gauge * (offset * At(10)));
  ExpectNear(anchors.ModelFromTracker() * (gauge * At(10)), gauge * (offset * At(10)));
}

TEST(AnchorMap, LetsGoOfItWhenTheTrackerConvergesInOneStep) {
  const Similarity offset = PartOfALoop(0.3);
  AnchorMap anchors = WithMovedAnchors(offset);
  const auto poses =
      MovedPoses(anchors, [&](std::uint32_t i) { return i < 3 ? Similarity() : offset; });
  EXPECT_FALSE(Update(anchors, poses));  // the model was there already
  ExpectNear(anchors.S_world_kf()[5], offset * At(10));
  EXPECT_FALSE(anchors.anchor(5).is_moved);
}

// In steps each of which is shorter than half the way.
TEST(AnchorMap, LetsGoOfItWhenTheTrackerConvergesStepByStep) {
  const Similarity offset = PartOfALoop(0.3);
  AnchorMap anchors = WithMovedAnchors(offset);
  for (int step = 1; step <= 5; ++step) {
    const Similarity so_far = PartOfALoop(0.06 * step);
    std::vector<KeyframePose> poses;
    for (int i = 0; i < 6; ++i) {
      poses.push_back({10 * i, 0, i < 3 ? At(2.0 * i) : so_far * At(2.0 * i)});
    }
    (void)Update(anchors, poses);
  }
  ExpectNear(anchors.S_world_kf()[5], PartOfALoop(0.3) * At(10));
}

TEST(AnchorMap, MovesASubmapAsAWhole) {
  AnchorMap anchors;
  for (int i = 0; i < 4; ++i) anchors.Add(AnchorAt(i), AnchorAt(i).S_tracker_kf, i / 2);
  EXPECT_EQ(anchors.SubmapIds(), (std::vector<int>{0, 1}));
  const Similarity motion = PartOfALoop(1);
  anchors.MoveSubmap(1, motion);
  ExpectNear(anchors.S_world_kf()[1], At(2));
  ExpectNear(anchors.S_world_kf()[2], motion * At(4));
  anchors.JoinSubmaps(0, 1);
  EXPECT_EQ(anchors.SubmapIds(), std::vector<int>{0});
  EXPECT_EQ(anchors.SubmapOf(3), 0);
  ExpectNear(anchors.S_world_kf()[3], motion * At(6));
  EXPECT_EQ(anchors.NextSubmapId(), 2);
}

TEST(AnchorMap, TakesOverAnotherOne) {
  AnchorMap anchors = Flight(3);
  AnchorMap other = Flight(2);
  other.MoveSubmap(0, PartOfALoop(1));
  anchors.Append(std::move(other));
  ASSERT_EQ(anchors.size(), 5U);
  EXPECT_EQ(anchors.SubmapIds(), (std::vector<int>{0, 1}));
  ExpectNear(anchors.S_world_kf()[4], PartOfALoop(1) * At(2));
  anchors.MoveSubmap(1, PartOfALoop(1).Inverse());
  ExpectNear(anchors.S_world_kf()[4], At(2));
  anchors.RemoveFrom(3);
  EXPECT_EQ(anchors.SubmapIds(), std::vector<int>{0});
}

// What two depth maps agree on is the mean of both, and goes where the mean of both goes.
TEST(AnchorMap, SurfelsMoveAsTheMeanOfThoseThatConfirmedThem) {
  AnchorMap anchors = Flight(2);
  anchors.LatestConfirmed(0, 0.5, 2.0 / 3);
  const auto pose = [](int i, const Similarity& S) { return KeyframePose{10 * i, 0, S}; };
  EXPECT_TRUE(Update(anchors, {pose(0, At(0)), pose(1, At(5))}));  // by 3 su
  ExpectNear(anchors.S_world_kf()[0], At(0));
  ExpectNear(anchors.S_world_surfels()[0], At(1));  // a third of it
  ExpectNear(anchors.S_world_surfels()[1], At(5));
  EXPECT_TRUE(Update(anchors, {pose(0, At(0)), pose(1, At(2))}));
  ExpectNear(anchors.S_world_surfels()[0], At(0));
}

TEST(AnchorMap, SurfelsThatOneSawAloneMoveWithIt) {
  AnchorMap anchors = Flight(3);
  anchors.LatestConfirmed(1, 0, 1);
  EXPECT_TRUE(
      Update(anchors, MovedPoses(anchors, [](std::uint32_t i) { return PartOfALoop(0.3 * i); })));
  for (std::uint32_t i = 0; i < 3; ++i) {
    ExpectNear(anchors.S_world_surfels()[i], anchors.S_world_kf()[i]);
  }
}

// Hovering: everything confirms everything. All have a say still.
TEST(AnchorMap, KeepsABoundedNumberOfObservers) {
  constexpr int kNumAnchors = 100;
  AnchorMap anchors;
  for (int i = 0; i < kNumAnchors; ++i) {
    anchors.Add(AnchorAt(i), AnchorAt(i).S_tracker_kf, 0);
    anchors.LatestConfirmed(0, 1, 1.0 / (i + 1));
  }
  const auto moved = [](std::uint32_t i) { return At(0.01 * i); };
  EXPECT_TRUE(Update(anchors, MovedPoses(anchors, moved)));
  // Half of what the last one moves, but for the coarse sample.
  EXPECT_NEAR(anchors.S_world_surfels()[0].pose().translation().x(), 0.5, 0.06);
}

TEST(AnchorMap, KnowsWhichAnchorsAreOnePart) {
  AnchorMap anchors;
  for (int i = 0; i < 8; ++i) anchors.Add(AnchorAt(i), AnchorAt(i).S_tracker_kf, i < 6 ? 0 : 1);
  EXPECT_TRUE(anchors.AreOnePart(1, 4));
  EXPECT_FALSE(anchors.AreOnePart(1, 5));
  EXPECT_FALSE(anchors.AreOnePart(5, 6));  // of another submap
  anchors.JoinSubmaps(0, 1);
  EXPECT_FALSE(anchors.AreOnePart(5, 6));  // they were never merged all the same
  EXPECT_EQ(anchors.EndOfOlderParts(), (std::vector<std::uint32_t>{0, 0, 0, 0, 1, 2, 6, 6}));
}

TEST(ViewsOfOverlap, AreThoseThatSeePartsMovedAgainstThem) {
  // There, 12 su on, and back.
  AnchorMap anchors;
  for (int i = 0; i < 12; ++i) {
    Anchor anchor = AnchorAt(i);
    anchor.S_tracker_kf = At(i < 6 ? 4.0 * i : 4.0 * (11 - i));
    anchors.Add(anchor, anchor.S_tracker_kf, 0);
  }
  const std::vector<Similarity> before = anchors.S_world_kf();
  const auto shift_by = [&](double su) {
    const auto poses =
        MovedPoses(anchors, [&](std::uint32_t i) { return i < 6 ? Similarity() : At(su); });
    EXPECT_TRUE(Update(anchors, poses));
    return ViewsOfOverlap(anchors, before);
  };
  EXPECT_TRUE(shift_by(0.05).empty());  // half a pixel
  const std::vector<std::uint32_t> views = shift_by(0.5);
  ASSERT_FALSE(views.empty());
  EXPECT_EQ(views.front(), 0U);
  EXPECT_EQ(views.back(), 11U);
}

TEST(Evenly, TakesTheFirstAndTheLast) {
  EXPECT_EQ(Evenly({1, 2, 3, 4, 5, 6, 7}, 3), (std::vector<std::uint32_t>{1, 4, 7}));
  EXPECT_EQ(Evenly({1, 2}, 3), (std::vector<std::uint32_t>{1, 2}));
}

}  // namespace
}  // namespace mono3d
