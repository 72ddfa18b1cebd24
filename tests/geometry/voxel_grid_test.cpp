// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/voxel_grid.h"

#include <gtest/gtest.h>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

PointCloud ThreePoints() {
  PointCloud cloud;
  cloud.points = {{0.25F, 0.5F, 0.5F}, {-0.5F, 0.5F, 0.5F}, {0.75F, 0.5F, 0.5F}};
  cloud.normals = {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}};
  cloud.colours = {{0, 100, 200}, {1, 2, 3}, {100, 100, 100}};
  cloud.radii = {0.5F, 0.5F, 3};
  cloud.confidences = {0.5F, 0.25F, 0.5F};
  cloud.observations = {2, 7, 5};
  cloud.first_frames = {30, 10, 20};
  return cloud;
}

TEST(VoxelGrid, MakesOnePointOfACell) {
  const PointCloud thin = ThinToVoxels(ThreePoints(), 1);
  ASSERT_EQ(thin.size(), 2U);
  EXPECT_TRUE(thin.points[0].isApprox(Eigen::Vector3f(0.5F, 0.5F, 0.5F)));
  EXPECT_TRUE(thin.normals[0].isApprox(Eigen::Vector3f(0, 1, 1).normalized()));
  EXPECT_EQ(thin.colours[0], (std::array<std::uint8_t, 3>{50, 100, 150}));
  EXPECT_EQ(thin.radii[0], 3);
  EXPECT_EQ(thin.confidences[0], 0.5F);
  EXPECT_EQ(thin.observations[0], 5U);
  EXPECT_EQ(thin.first_frames[0], 20U);
  // The cell on the other side of 0 is another one; its disc must reach its neighbours.
  EXPECT_TRUE(thin.points[1].isApprox(Eigen::Vector3f(-0.5F, 0.5F, 0.5F)));
  EXPECT_NEAR(thin.radii[1], 0.7071, 1e-4);
}

TEST(VoxelGrid, WeighsByConfidence) {
  PointCloud cloud;
  cloud.points = {{0, 0, 0}, {0.8F, 0, 0}};
  cloud.confidences = {0.75F, 0.25F};
  EXPECT_NEAR(ThinToVoxels(cloud, 1).points[0].x(), 0.2, 1e-5);
  cloud.confidences.clear();
  EXPECT_NEAR(ThinToVoxels(cloud, 1).points[0].x(), 0.4, 1e-5);
}

TEST(VoxelGrid, KeepsAllWhereCellsAreSmall) {
  EXPECT_EQ(ThinToVoxels(ThreePoints(), 0.1).size(), 3U);
  EXPECT_TRUE(ThinToVoxels({}, 1).empty());
}

TEST(VoxelGrid, TellsPointsApartThatLieBeyondAllCells) {
  PointCloud cloud;
  cloud.points = {{3e38F, 0, 0}, {-3e38F, 0, 0}};
  EXPECT_EQ(ThinToVoxels(cloud, 1e-3).size(), 2U);
}

TEST(VoxelGrid, RefusesWhatItCannotThin) {
  EXPECT_THROW(ThinToVoxels(ThreePoints(), 0), Error);
  PointCloud uneven = ThreePoints();
  uneven.radii.pop_back();
  EXPECT_THROW(ThinToVoxels(uneven, 1), Error);
}

}  // namespace
}  // namespace mono3d
