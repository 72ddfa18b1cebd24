// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/products/surface_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "io/temporary_folder.h"
#include "mono3d/core/error.h"
#include "mono3d/io/ply_file.h"

namespace mono3d {
namespace {

constexpr float kSpacing = 0.1F;

void AddSurfel(PointCloud& cloud, const Eigen::Vector3f& point, const Eigen::Vector3f& normal) {
  cloud.points.push_back(point);
  cloud.normals.push_back(normal.normalized());
  cloud.radii.push_back(0.08F);
  cloud.confidences.push_back(0.9F);
}

// 10 x 8 m of level ground at height 2, on it a box of 2 x 2 m and 3 m of height with its top and
// its walls; the ground below the box is not seen, nor is that of a square metre at (8, 6).
PointCloud GroundWithBox() {
  PointCloud cloud;
  const auto is_on_box = [](float x, float y) { return x > 3 && x < 5 && y > 2 && y < 4; };
  for (int j = 0; j < 80; ++j) {
    for (int i = 0; i < 100; ++i) {
      const float x = (static_cast<float>(i) + 0.5F) * kSpacing;
      const float y = (static_cast<float>(j) + 0.5F) * kSpacing;
      if (x > 8 && x < 9 && y > 6 && y < 7) continue;
      AddSurfel(cloud, {x, y, is_on_box(x, y) ? 5.F : 2.F}, {0, 0, 1});
    }
  }
  for (int k = 0; k < 30; ++k) {
    for (int i = 0; i < 20; ++i) {
      const float along = (static_cast<float>(i) + 0.5F) * kSpacing;
      const float up = 2 + (static_cast<float>(k) + 0.5F) * kSpacing;
      AddSurfel(cloud, {3, 2 + along, up}, {-1, 0, 0});
      AddSurfel(cloud, {5, 2 + along, up}, {1, 0, 0});
    }
  }
  return cloud;
}

class SurfaceModelTest : public TemporaryFolderTest {
 protected:
  cv::Mat HeightsOf(const PointCloud& cloud, const RasterGrid& grid) const {
    WritePly(folder_ / "model.ply", cloud);
    const MapAxes axes;
    MapSurfels surfels(folder_ / "model.ply", axes);
    cv::Mat all(grid.height, grid.width, CV_32FC1, cv::Scalar(0));
    MakeSurfaceModel(surfels, axes, grid, [&](const cv::Rect& place, const cv::Mat& cells) {
      cells.copyTo(all(place));
    });
    return all;
  }
};

constexpr RasterGrid kTenByEight = {.west = 0, .north = 8, .cell = 0.1, .width = 100, .height = 80};

TEST_F(SurfaceModelTest, HasTheTopOfABoxOnTheGround) {
  const cv::Mat heights = HeightsOf(GroundWithBox(), kTenByEight);
  for (int row = 1; row < 79; ++row) {
    for (int column = 1; column < 99; ++column) {
      const Eigen::Vector2d place = kTenByEight.ToMap(column, row);
      if (place.x() > 7.8 && place.x() < 9.2 && place.y() > 5.8 && place.y() < 7.2) continue;
      // Next to the box its top may reach over.
      const double from_box = std::max(std::abs(place.x() - 4), std::abs(place.y() - 3)) - 1;
      if (std::abs(from_box) < 0.1) continue;
      EXPECT_NEAR(heights.at<float>(row, column), from_box < 0 ? 5 : 2, 1e-4) << place.transpose();
    }
  }
}

TEST_F(SurfaceModelTest, LeavesHolesOpen) {
  const cv::Mat heights = HeightsOf(GroundWithBox(), kTenByEight);
  int num_holes = 0;
  for (int row = 0; row < 80; ++row) {
    for (int column = 0; column < 100; ++column) {
      if (heights.at<float>(row, column) == kNoHeight) ++num_holes;
    }
  }
  EXPECT_GE(num_holes, 8 * 8);
  EXPECT_LE(num_holes, 10 * 10);
  EXPECT_EQ(heights.at<float>(14, 84), kNoHeight);
}

TEST_F(SurfaceModelTest, LeavesOutWhatFloats) {
  PointCloud cloud = GroundWithBox();
  AddSurfel(cloud, {1.03F, 1.02F, 4.5F}, {0, 0, 1});  // above the ground
  AddSurfel(cloud, {8.5F, 6.5F, 9}, {0, 0, 1});       // in the hole
  const cv::Mat heights = HeightsOf(cloud, kTenByEight);
  EXPECT_NEAR(heights.at<float>(69, 10), 2, 1e-4);
  EXPECT_NEAR(heights.at<float>(70, 10), 2, 1e-4);
  double highest = 0;
  cv::minMaxLoc(heights, nullptr, &highest);
  EXPECT_NEAR(highest, 5, 1e-4);
}

TEST_F(SurfaceModelTest, FollowsASlopeBetweenSurfels) {
  PointCloud cloud;
  // A slope of 1:2, surfels half a metre apart, cells of a tenth.
  for (int j = 0; j < 8; ++j) {
    for (int i = 0; i < 8; ++i) {
      const float x = 0.5F * static_cast<float>(i), y = 0.5F * static_cast<float>(j);
      AddSurfel(cloud, {x, y, 0.5F * x}, {-0.5F, 0, 1});
      cloud.radii.back() = 0.5F;
    }
  }
  const RasterGrid grid = {.west = 0, .north = 3, .cell = 0.1, .width = 30, .height = 30};
  const cv::Mat heights = HeightsOf(cloud, grid);
  for (int row = 0; row < 30; ++row) {
    for (int column = 0; column < 30; ++column) {
      EXPECT_NEAR(heights.at<float>(row, column), 0.5 * grid.ToMap(column, row).x(), 1e-4);
    }
  }
}

TEST(RasterGrid, LiesAtWholeCells) {
  const RasterGrid grid =
      GridOver({Eigen::Vector2d(10.03, -5.01), Eigen::Vector2d(12.21, -2.98)}, 0.5);
  EXPECT_EQ(grid.west, 10);
  EXPECT_EQ(grid.north, -2.5);
  EXPECT_EQ(grid.width, 5);
  EXPECT_EQ(grid.height, 6);
  EXPECT_TRUE(grid.ToMap(0, 0).isApprox(Eigen::Vector2d(10.25, -2.75)));
  EXPECT_TRUE(grid.ToCell({10.25, -2.75}).isZero(1e-9));
  EXPECT_THROW(GridOver({Eigen::Vector2d(0, 0), Eigen::Vector2d(1e6, 1e6)}, 0.1), Error);
}

TEST(RoundedCell, HasTwoDigits) {
  EXPECT_NEAR(RoundedCell(0.0437), 0.044, 1e-12);
  EXPECT_NEAR(RoundedCell(0.044), 0.044, 1e-12);
  EXPECT_NEAR(RoundedCell(12.01), 13, 1e-12);
}

TEST(GroundSampleDistance, IsDepthOverFocalLength) {
  FinishedRun run;
  run.sparse.camera = {.width = 100, .height = 80, .fx = 50, .fy = 50, .cx = 50, .cy = 40};
  SparseImage image;
  for (const double z : {9.0, 10.0, 30.0}) {
    image.observations.push_back({.point = run.sparse.points.size()});
    run.sparse.points.push_back({.p_world = {0, 0, z}});
  }
  run.sparse.images = {image};
  run.images.emplace_back().camera = run.sparse.camera;
  EXPECT_DOUBLE_EQ(GroundSampleDistance(run, false), 0.2);
  run.depth_camera = run.sparse.camera.Resized(50, 40);
  EXPECT_DOUBLE_EQ(GroundSampleDistance(run, false), 0.2);
  EXPECT_DOUBLE_EQ(GroundSampleDistance(run, true), 0.4);
}

}  // namespace
}  // namespace mono3d
