// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "fusion/registration_scene.h"
#include "fusion/submap.h"
#include "gpu/test_device.h"
#include "mono3d/fusion/surfel_map.h"
#include "mono3d/geometry/similarity.h"

// Parts of the model that no depth map connects, and how they become one.
namespace mono3d {
namespace {

using Eigen::Vector3d;

// The view of a place on a line along the house; its number is that of the place.
TrackedMap View(int x_su, const HouseScene& scene = {}) {
  TrackedMap map = HouseViewFrom(scene, PoseOver(x_su, 0));
  map.keyframe_id = map.frame_index = 100 + x_su;
  map.depth_sigma_per_square_depth /= 5;  // of a baseline of half the distance
  return map;
}

// What the tracker's world has become while there was no depth map.
Similarity Drift() {
  return {1.02, Pose(RotationExp({0.006, -0.008, 0.01}), Vector3d(0.15, -0.2, 0.1))};
}

TrackedMap Drifted(TrackedMap map, const Similarity& drift) {
  map.T_world_cam = drift * map.T_world_cam;
  map.depth = map.depth * drift.scale();
  map.depth_sigma_per_square_depth /= drift.scale();
  return map;
}

struct Flight {
  std::unique_ptr<TrackedModel> model;
  std::vector<TrackedMap> maps;  // of the tracker
  int num_started = 0;
  int max_submaps = 0;
  std::vector<SubmapJoin> joins;
  FusionResult last;
};

// Three views on the left; then, in a tracker's world that has drifted, from the right back to near
// them.
Flight Fly(const Similarity& drift, const HouseScene& scene = {}) {
  Flight flight;
  flight.model = CreateTrackedModel();
  for (const int x : {-20, -19, -18, 4, 2, 0, -2, -4, -5, -6, -8, -10}) {
    const TrackedMap view = View(x, scene);
    flight.maps.push_back(x < -15 ? view : Drifted(view, drift));
    const FusionResult result = flight.model->Integrate(flight.maps.back());
    flight.num_started += result.starts_submap ? 1 : 0;
    flight.max_submaps = std::max(flight.max_submaps, result.health.num_submaps);
    flight.joins.insert(flight.joins.end(), result.submap_joins.begin(), result.submap_joins.end());
    flight.last = result;
  }
  return flight;
}

double FromTruth_px(std::int64_t frame_index, const Pose& T_world_cam) {
  const int x_su = static_cast<int>(frame_index) - 100;
  return ImageDistance_px(T_world_cam, PoseOver(x_su, 0));
}

TEST(Submaps, BecomeOneWhereADepthMapShowsBoth) {
  const Flight flight = Fly(Drift());
  EXPECT_EQ(flight.num_started, 1);
  EXPECT_EQ(flight.max_submaps, 2);
  ASSERT_EQ(flight.joins.size(), 1U);
  const SubmapJoin& join = flight.joins.front();
  EXPECT_EQ(join.num_submaps, 1);
  EXPECT_GT(join.moved_px, 1);
  EXPECT_GT(join.num_merged, 0);
  // A third of the image was enough to go by: what is known to a pixel there is less so elsewhere.
  constexpr double kTolerance_px = 2;
  constexpr double kScaleTolerance = 0.01;
  double before_px = 0;
  for (const FusedDepthMap& map : flight.model->DepthMaps()) {
    EXPECT_LT(FromTruth_px(map.frame_index, map.S_world_kf.pose()), kTolerance_px);
    if (map.frame_index < 85) continue;
    EXPECT_NEAR(map.S_world_kf.scale() * Drift().scale(), 1, kScaleTolerance);
    const auto of_tracker =
        std::ranges::find(flight.maps, map.frame_index, &TrackedMap::frame_index);
    before_px = std::max(before_px, FromTruth_px(map.frame_index, of_tracker->T_world_cam));
  }
  EXPECT_GT(before_px, 2 * kTolerance_px);
  EXPECT_EQ(flight.last.health.num_submaps, 1);
  EXPECT_LT(FromTruth_px(90, flight.last.S_world_kf.pose()), kTolerance_px);
  EXPECT_LT(FalseShare(flight.model->Export(1), {View(-19), View(-8), View(0), View(4)}), 0.02);
}

// Where the tracker's poses are right, there is nothing to move.
TEST(Submaps, StayWhereTheTrackerIsRight) {
  const Flight flight = Fly(Similarity());
  EXPECT_EQ(flight.last.health.num_submaps, 1);
  for (const SubmapJoin& join : flight.joins) {
    EXPECT_EQ(join.moved_px, 0);
    EXPECT_EQ(join.num_merged, 0);
  }
}

// Grey ground holds no depth map in its plane: no submap may be moved by such a pose.
TEST(Submaps, AreNotMovedByAPoseThatNothingHolds) {
  HouseScene bare;
  bare.with_house = false;
  bare.with_texture = false;
  for (const SubmapJoin& join : Fly(Drift(), bare).joins) {
    EXPECT_EQ(join.moved_px, 0);
    EXPECT_EQ(join.num_merged, 0);
  }
}

// The tracker closes a loop after all: what the model has moved already must not move twice.
TEST(Submaps, AreNotMovedTwice) {
  const Flight flight = Fly(Drift());
  std::vector<KeyframePose> moved;
  for (const TrackedMap& map : flight.maps) {
    const bool has_drifted = map.frame_index > 85;
    moved.push_back({map.keyframe_id, 0,
                     Similarity(has_drifted ? 1 / Drift().scale() : 1,
                                PoseOver(static_cast<double>(map.frame_index) - 100, 0))});
  }
  EXPECT_TRUE(flight.model->Update(moved).has_moved);
  ASSERT_EQ(flight.model->DepthMaps().size(), flight.maps.size());
  for (const FusedDepthMap& map : flight.model->DepthMaps()) {
    EXPECT_LT(FromTruth_px(map.frame_index, map.S_world_kf.pose()), 1e-6);
  }
  const FusionResult next = flight.model->Integrate(View(3));
  EXPECT_EQ(next.status, FusionStatus::kFused);
  EXPECT_FALSE(next.registration.moved);
}

TEST(Submaps, MoveAsAWhole) {
  const Similarity S_world_kf(1, Pose(Eigen::Quaterniond::Identity(), Vector3d(1, 0, 0)));
  Submap submap(0);
  submap.Add(3, S_world_kf);
  const Similarity motion(2, Pose(RotationExp({0, 0, 0.5}), Vector3d(1, 2, 3)));
  submap.Move(motion);
  submap.Add(7, S_world_kf);
  const Vector3d p(0.3, -0.2, 4);
  EXPECT_LT((submap.S_world_kf(3) * p - motion * (S_world_kf * p)).norm(), 1e-12);
  EXPECT_LT((submap.S_world_kf(7) * p - S_world_kf * p).norm(), 1e-12);

  Submap other(1);
  other.Add(5, S_world_kf);
  submap.TakeOver(other);
  EXPECT_TRUE(std::ranges::equal(submap.anchors(), std::vector<std::uint32_t>{3, 5, 7}));
  EXPECT_LT((submap.S_world_kf(5) * p - S_world_kf * p).norm(), 1e-12);
  submap.RemoveFrom(5);
  EXPECT_TRUE(std::ranges::equal(submap.anchors(), std::vector<std::uint32_t>{3}));
}

}  // namespace
}  // namespace mono3d
