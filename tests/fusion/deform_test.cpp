// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "fusion/corrector.h"
#include "fusion/fusion_scene.h"
#include "gpu/test_device.h"
#include "reference/fusion/correct_reference.h"

namespace mono3d {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr float kDepth_su = 10;

// A flight along x over ground 10 su away, one view every 2 su.
std::vector<FusedView> Flight(int num_views) {
  std::vector<FusedView> views;
  for (int i = 0; i < num_views; ++i) {
    FusedView view;
    view.keyframe_id = view.frame_index = 10 * i;
    view.camera = TestCamera(96, 64);
    view.S_tracker_kf = view.S_world_kf =
        Similarity(1, Pose(Eigen::Quaterniond::Identity(), Vector3d(2.0 * i, 0, 0)));
    view.median_depth_su = kDepth_su;
    views.push_back(view);
  }
  return views;
}

// The poses of a tracker that has found its world to be `motion` of what it was, at each view.
template <typename MotionOf>
std::vector<KeyframePose> MovedPoses(const std::vector<FusedView>& views, MotionOf&& motion_of) {
  std::vector<KeyframePose> poses;
  for (std::size_t i = 0; i < views.size(); ++i) {
    poses.push_back({views[i].keyframe_id, 0, motion_of(i) * views[i].S_tracker_kf});
  }
  return poses;
}

std::vector<Similarity> MoveTo(const std::vector<KeyframePose>& poses,
                               std::vector<FusedView>& views) {
  return MoveViews(views, KeyframePoses(1, poses), 0);
}

// Surfels at random places of the ground, each anchored to the view above it.
Surfels Ground(int num_views, int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> along(0, 2.0F * static_cast<float>(num_views - 1));
  std::uniform_real_distribution<float> across(-4, 4);
  Surfels surfels;
  for (int i = 0; i < count; ++i) {
    const Vector3f p(along(random), across(random), kDepth_su + 0.2F * across(random));
    Append(surfels, OneSurfel(p, Vector3f(0.1F, 0.2F, -1).normalized(), 4));
    surfels.history.back()[3] |= static_cast<std::uint32_t>(std::lround(p.x() / 2));
  }
  return surfels;
}

Surfels Deformed(const Surfels& surfels, const std::vector<DeformationNode>& nodes) {
  SurfelStorage storage(TestDevice(), 100'000);
  storage.Upload(surfels);
  Recorder recorder(TestDevice());
  Corrector(TestDevice()).Deform(recorder, nodes, storage, nullptr);
  return storage.Download();
}

Vector3f Position(const Surfels& surfels, std::size_t i) {
  const auto& p = surfels.position_radius[i];
  return {p[0], p[1], p[2]};
}

// 5 degrees and 3 % of scale, spread over the flight.
Similarity PartOfALoop(double share) {
  return {std::exp(0.03 * share),
          Pose(RotationExp(share * 5 * M_PI / 180 * Vector3d(0.2, -0.4, 0.9).normalized()),
               share * Vector3d(0.5, 0.3, -0.2))};
}

// Positions in single precision at some 40 su from the origin.
constexpr float kRounding_su = 1e-4F;

TEST(Deform, LeavesAloneWhatDoesNotMove) {
  std::vector<FusedView> views = Flight(12);
  const std::vector<Similarity> motions(views.size());
  const Surfels before = Ground(12, 500, 1);
  const Surfels after = Deformed(before, MakeNodes(views, motions));
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_LT((Position(after, i) - Position(before, i)).norm(), kRounding_su);
    EXPECT_NEAR(after.normal_weight[i][3], before.normal_weight[i][3], 1e-4);
  }
}

// Local adjustments by parts of a pixel are left for later, but not forgotten.
TEST(Deform, WaitsUntilAMotionCanBeNoticed) {
  std::vector<FusedView> views = Flight(6);
  const auto turned = [&](double angle_px) {
    const double angle_rad = angle_px / views.front().camera.fx;
    return MovedPoses(Flight(6), [&](std::size_t i) {
      return i != 2 ? Similarity() : Similarity(1, Pose(RotationExp({0, 0, angle_rad}), {0, 0, 0}));
    });
  };
  EXPECT_TRUE(MoveTo(turned(0.05), views).empty());
  EXPECT_EQ(views[2].S_tracker_kf.pose().RotationAngle(), 0);
  EXPECT_EQ(MoveTo(turned(2), views).size(), 6U);
  EXPECT_GT(views[2].S_tracker_kf.pose().RotationAngle(), 0);
}

TEST(Deform, MovesAllAlikeWhenAllViewsDo) {
  const Similarity motion = PartOfALoop(1);
  std::vector<FusedView> views = Flight(12);
  const auto motions = MoveTo(MovedPoses(views, [&](std::size_t) { return motion; }), views);
  const Surfels before = Ground(12, 500, 2);
  const Surfels after = Deformed(before, MakeNodes(views, motions));
  for (std::size_t i = 0; i < before.size(); ++i) {
    const Vector3d expected = motion * Position(before, i).cast<double>();
    EXPECT_LT((Position(after, i).cast<double>() - expected).norm(), kRounding_su);
    EXPECT_NEAR(after.position_radius[i][3], motion.scale() * before.position_radius[i][3], 1e-5);
    EXPECT_NEAR(after.normal_weight[i][3] * std::pow(motion.scale(), 2), before.normal_weight[i][3],
                1e-4);
  }
}

TEST(Deform, EqualsReference) {
  std::vector<FusedView> views = Flight(20);
  const auto motions = MoveTo(
      MovedPoses(views, [](std::size_t i) { return PartOfALoop(static_cast<double>(i) / 19); }),
      views);
  const auto nodes = MakeNodes(views, motions);
  Surfels expected = Ground(20, 3000, 3);
  expected.normal_weight[7] = {0, 0, 0, 0};  // removed: stays so
  const Surfels found = Deformed(expected, nodes);
  reference::Deform(nodes, kDeformationWindow, expected);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_NEAR(found.position_radius[i][k], expected.position_radius[i][k], kRounding_su);
      EXPECT_NEAR(found.normal_weight[i][k], expected.normal_weight[i][k], 1e-4);
    }
  }
}

// Neighbours anchored to different views must not come apart: across a step of the anchor no more
// than half of what the views themselves move against each other.
TEST(Deform, DoesNotTearBetweenAnchors) {
  constexpr int kNumViews = 20;
  std::vector<FusedView> views = Flight(kNumViews);
  const auto motions = MoveTo(
      MovedPoses(
          views,
          [](std::size_t i) { return PartOfALoop(static_cast<double>(i) / (kNumViews - 1)); }),
      views);
  Surfels pairs;
  for (int i = 4; i < kNumViews - 5; ++i) {
    for (const int anchor : {i, i + 1}) {
      Append(pairs, OneSurfel({2.0F * static_cast<float>(i) + 1, 1.5F, 10}, {0, 0, -1}, 4));
      pairs.history.back()[3] |= static_cast<std::uint32_t>(anchor);
    }
  }
  const Surfels after = Deformed(pairs, MakeNodes(views, motions));
  // Of what their views move apart: one part in four, for a surfel follows three views to each
  // side, at weights that fall to 0 with the fourth. Measured 0.250.
  constexpr double kMaxGap = 0.27;
  for (std::size_t i = 0; i < after.size(); i += 2) {
    const std::size_t anchor = Low16(pairs.history[i][3]);
    const Vector3d p = Position(pairs, i).cast<double>();
    const double step = (motions[anchor] * p - motions[anchor + 1] * p).norm();
    EXPECT_LT((Position(after, i) - Position(after, i + 1)).norm(), kMaxGap * step);
  }
}

TEST(Deform, ViewsWithoutAPoseMoveWithTheirNeighbour) {
  std::vector<FusedView> views = Flight(4);
  auto poses =
      MovedPoses(views, [](std::size_t i) { return PartOfALoop(0.25 * static_cast<double>(i)); });
  poses.erase(poses.begin() + 2);
  poses.erase(poses.begin());
  const auto motions = MoveTo(poses, views);
  ASSERT_EQ(motions.size(), 4U);
  EXPECT_EQ(motions[0].scale(), motions[1].scale());
  EXPECT_EQ(motions[2].scale(), motions[1].scale());
  EXPECT_NEAR(motions[3].scale(), std::exp(0.03 * 0.75), 1e-12);
  EXPECT_TRUE(MoveTo({}, views).empty());
}

TEST(Deform, AppliesTheSamePosesOnce) {
  std::vector<FusedView> views = Flight(3);
  const auto poses = MovedPoses(views, [](std::size_t) { return PartOfALoop(1); });
  EXPECT_EQ(MoveTo(poses, views).size(), 3U);
  EXPECT_TRUE(MoveTo(poses, views).empty());
}

}  // namespace
}  // namespace mono3d
