// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/depth_scale.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/byte_archive.h"
#include "fusion/fusion_scene.h"
#include "fusion/state_archive.h"

namespace mono3d {
namespace {

using Eigen::Vector3d;

constexpr double kDepth_su = 10;
constexpr double kRounding = 1e-9;

// Two cameras to the left and two to the right of the one in the middle, number 2, which is the
// reference; all look ahead.
std::vector<KeyframePose> Row(double baseline) {
  std::vector<KeyframePose> poses;
  for (int i = 0; i < 5; ++i) {
    const Pose pose(Eigen::Quaterniond::Identity(), Vector3d(baseline * (i - 2), 0, 0));
    poses.push_back({i, 0, Similarity(1, pose)});
  }
  return poses;
}

// Matched with these poses, of a plane at kDepth_su.
DepthMap MatchedWith(const std::vector<KeyframePose>& poses) {
  DepthMap map = PlaneMap(TestCamera(96, 64), Pose(), {{0, 0, -1}, -kDepth_su});
  map.keyframe_id = 2;
  for (const int i : {0, 1, 3, 4}) {
    const KeyframePose& pose = poses[static_cast<std::size_t>(i)];
    map.views.push_back({i, RelativePose(poses[2].S_world_kf, pose.T_world_cam())});
  }
  return map;
}

double Update(DepthScale& scale, std::vector<KeyframePose> poses) {
  const KeyframePoses table(1, std::move(poses));
  return scale.Update(table, table.At(2));
}

TEST(DepthScale, IsExactlyOneWhereNothingHasChanged) {
  DepthScale scale(MatchedWith(Row(1)), kDepth_su);
  EXPECT_EQ(Update(scale, Row(1)), 1);
  EXPECT_EQ(DepthScale().value(), 1);
}

TEST(DepthScale, FollowsTheBaseline) {
  DepthScale scale(MatchedWith(Row(1)), kDepth_su);
  EXPECT_NEAR(Update(scale, Row(0.9)), 0.9, kRounding);
  EXPECT_NEAR(Update(scale, Row(1.1)), 1.1, kRounding);
  EXPECT_EQ(scale.value(), Update(scale, Row(1.1)));
  EXPECT_NEAR(Update(scale, Row(1)), 1, kRounding) << "not of the way there";
}

// A world that is larger as a whole has keyframes with a larger own unit.
TEST(DepthScale, IsInTheOwnUnitOfTheKeyframe) {
  DepthScale scale(MatchedWith(Row(1)), kDepth_su);
  std::vector<KeyframePose> larger = Row(3);
  for (KeyframePose& pose : larger) pose.S_world_kf = {3, pose.T_world_cam()};
  EXPECT_NEAR(Update(scale, larger), 1, kRounding);
}

// A view that is moved by b to the right, and turned by the angle a to the right, sees what is z
// away in the reference's middle at -b / z - a. Where that stays, and a grows by b * t, 1 / z
// shrinks by t.
TEST(DepthScale, FollowsRotationsAsWell) {
  constexpr double kTurn_rad = 0.002;  // t
  const std::vector<KeyframePose> before = Row(1);
  std::vector<KeyframePose> after = before;
  for (KeyframePose& pose : after) {
    const Vector3d& centre = pose.T_world_cam().translation();
    pose.S_world_kf = {1, Pose(RotationExp({0, kTurn_rad * centre.x(), 0}), centre)};
  }
  DepthScale scale(MatchedWith(before), kDepth_su);
  const double expected = 1 / (1 - kTurn_rad * kDepth_su);
  // At the image's sides, 22 degrees off, a turn moves it by a sixth more.
  EXPECT_NEAR(Update(scale, after) - 1, expected - 1, 0.16 * (expected - 1));
}

TEST(DepthScale, AsksTheViewsThatAreKnown) {
  DepthScale scale(MatchedWith(Row(1)), kDepth_su);
  std::vector<KeyframePose> poses = Row(0.9);
  poses[1].map_id = 1;  // says nothing of this map
  poses[1].S_world_kf = {1, Pose(Eigen::Quaterniond::Identity(), Vector3d(70, 0, 0))};
  poses.erase(poses.begin());
  EXPECT_NEAR(Update(scale, poses), 0.9, kRounding);
  // None is left: what was known last.
  EXPECT_NEAR(Update(scale, {poses[1]}), 0.9, kRounding);
  DepthScale without_views(PlaneMap(TestCamera(96, 64), Pose()), kDepth_su);
  EXPECT_EQ(Update(without_views, Row(0.5)), 1);
}

TEST(DepthScale, GoesOnFromItsState) {
  DepthScale scale(MatchedWith(Row(1)), kDepth_su);
  std::vector<KeyframePose> poses = Row(0.9);
  poses.erase(poses.begin());
  Update(scale, poses);
  ByteWriter writer;
  scale.Exchange(writer);
  const std::string bytes = writer.TakeBytes();
  DepthScale again;
  ByteReader reader(bytes, "state", "test");
  again.Exchange(reader);
  EXPECT_EQ(again.value(), scale.value());
  EXPECT_EQ(Update(again, Row(0.8)), Update(scale, Row(0.8)));
}

}  // namespace
}  // namespace mono3d
