// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/map_joins.h"

#include <gtest/gtest.h>

#include <numbers>

namespace mono3d {
namespace {

constexpr double kTolerance = 1e-12;

Keyframe At(std::int64_t id, int map_id, const Eigen::Vector3d& position) {
  Keyframe keyframe;
  keyframe.id = id;
  keyframe.map_id = map_id;
  keyframe.T_world_cam = Pose(Eigen::Quaterniond::Identity(), position);
  return keyframe;
}

// Twice as large, a quarter turn about z, 10 further in x.
Similarity Turn() {
  return {2, Pose(RotationExp({0, 0, std::numbers::pi / 2}), Eigen::Vector3d(10, 0, 0))};
}

KeyframeCorrection Correct(const Keyframe& keyframe, int map_id, const Similarity& S) {
  return {keyframe.id, map_id, S * keyframe.T_world_cam, S.scale()};
}

TEST(MapJoins, FindsTheSimilarityOfAMapThatWentIntoAnother) {
  MapJoins joins;
  const Keyframe old = At(0, 0, {0, 0, 0});
  const Keyframe newer = At(1, 1, {1, 2, 3});
  joins.Remember(old);
  joins.Remember(newer);
  const std::vector<KeyframeCorrection> corrections = {Correct(old, 0, Similarity()),
                                                       Correct(newer, 0, Turn())};
  const std::vector<JoinedMap> joined = joins.Take(corrections);
  ASSERT_EQ(joined.size(), 1U);
  EXPECT_EQ(joined[0].from, 1);
  EXPECT_EQ(joined[0].into, 0);
  const Eigen::Vector3d p(-4, 5, 0.5);
  EXPECT_LT((joined[0].S_into_from * p - Turn() * p).norm(), kTolerance);
  // It has happened: the same again is no join.
  EXPECT_TRUE(joins.Take(corrections).empty());
}

TEST(MapJoins, MeasuresFromWhereALoopHadMovedTheMap) {
  MapJoins joins;
  const Keyframe keyframe = At(7, 1, {1, 0, 0});
  joins.Remember(keyframe);
  const Similarity loop(0.5, Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 3, 0)));
  EXPECT_TRUE(joins.Take(std::vector{Correct(keyframe, 1, loop)}).empty());
  const std::vector<JoinedMap> joined =
      joins.Take(std::vector{Correct(keyframe, 0, Turn() * loop)});
  ASSERT_EQ(joined.size(), 1U);
  EXPECT_NEAR(joined[0].S_into_from.scale(), 2, kTolerance);
  const Eigen::Vector3d p(1, 1, 1);
  EXPECT_LT((joined[0].S_into_from * p - Turn() * p).norm(), kTolerance);
}

TEST(MapJoins, MovesPosesAndSurfels) {
  const JoinedMap joined{1, 0, Turn()};
  std::vector<TrajectoryEntry> entries = {{0, 0, 0, Pose()},
                                          {1, 0, 1, At(0, 0, {1, 0, 0}).T_world_cam}};
  MoveEntries(joined, entries);
  EXPECT_EQ(entries[1].map_id, 0);
  EXPECT_LT((entries[1].T_world_cam.translation() - Eigen::Vector3d(10, 2, 0)).norm(), kTolerance);
  EXPECT_EQ(entries[0].T_world_cam.translation(), Eigen::Vector3d::Zero());

  PointCloud cloud;
  cloud.points = {{1, 0, 0}};
  cloud.normals = {{1, 0, 0}};
  cloud.radii = {0.5F};
  const PointCloud moved = Moved(Turn(), cloud);
  EXPECT_LT((moved.points[0] - Eigen::Vector3f(10, 2, 0)).norm(), 1e-5F);
  EXPECT_LT((moved.normals[0] - Eigen::Vector3f(0, 1, 0)).norm(), 1e-6F);
  EXPECT_FLOAT_EQ(moved.radii[0], 1);
  PointCloud both = cloud;
  AppendCloud(moved, both);
  EXPECT_EQ(both.size(), 2U);
  EXPECT_EQ(both.radii.size(), 2U);
  EXPECT_TRUE(both.colours.empty());
  cloud.radii.clear();
  AppendCloud(cloud, both);  // one without radii: then none has any
  EXPECT_EQ(both.size(), 3U);
  EXPECT_TRUE(both.radii.empty());
}

}  // namespace
}  // namespace mono3d
