// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/map_joins.h"

#include <gtest/gtest.h>

#include <numbers>

namespace mono3d {
namespace {

constexpr double kTolerance = 1e-12;

// Twice as large, a quarter turn about z, 10 further in x.
Similarity Turn() {
  return {2, Pose(RotationExp({0, 0, std::numbers::pi / 2}), Eigen::Vector3d(10, 0, 0))};
}

TEST(MapJoins, MovesPosesAndSurfels) {
  const MapJoin join{1, 0, Turn()};
  const Pose one_in_x(Eigen::Quaterniond::Identity(), Eigen::Vector3d(1, 0, 0));
  std::vector<TrajectoryEntry> entries = {{0, 0, 0, Pose()}, {1, 0, 1, one_in_x}};
  MoveEntries(join, entries);
  EXPECT_EQ(entries[1].map_id, 0);
  EXPECT_LT((entries[1].T_world_cam.translation() - Eigen::Vector3d(10, 2, 0)).norm(), kTolerance);
  EXPECT_EQ(entries[0].T_world_cam.translation(), Eigen::Vector3d::Zero());

  PointCloud cloud;
  cloud.points = {{1, 0, 0}};
  cloud.normals = {{1, 0, 0}};
  cloud.radii = {0.5F};
  cloud.first_frames = {40};
  const PointCloud moved = Moved(Turn(), cloud);
  EXPECT_LT((moved.points[0] - Eigen::Vector3f(10, 2, 0)).norm(), 1e-5F);
  EXPECT_LT((moved.normals[0] - Eigen::Vector3f(0, 1, 0)).norm(), 1e-6F);
  EXPECT_FLOAT_EQ(moved.radii[0], 1);
  PointCloud both = cloud;
  both.first_frames = {70};
  AppendCloud(moved, both);
  EXPECT_EQ(both.first_frames, (std::vector<std::uint32_t>{70, 40}));
  EXPECT_EQ(both.size(), 2U);
  EXPECT_EQ(both.radii.size(), 2U);
  EXPECT_TRUE(both.colours.empty());
  cloud.radii.clear();
  cloud.first_frames.clear();
  AppendCloud(cloud, both);  // one without radii: then none has any
  EXPECT_EQ(both.size(), 3U);
  EXPECT_TRUE(both.radii.empty());
  EXPECT_TRUE(both.first_frames.empty());
}

}  // namespace
}  // namespace mono3d
