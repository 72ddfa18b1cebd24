// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/evaluation/true_surface.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/evaluation/cloud_error.h"

namespace mono3d {
namespace {

// 41 pixels of 0.1 m at 10 m: the image shows x and y from -2 to 2 m.
CameraModel SurfaceCamera() {
  CameraModel camera;
  camera.width = camera.height = 41;
  camera.fx = camera.fy = 100;
  camera.cx = camera.cy = 20;
  return camera;
}

Pose PoseAt(double x_m) { return {Eigen::Quaterniond::Identity(), Eigen::Vector3d(x_m, 0, 0)}; }

TrueView ViewOfWall(double x_m, double depth_m = 10) {
  return {SurfaceCamera(), PoseAt(x_m), cv::Mat(41, 41, CV_32FC1, cv::Scalar(depth_m))};
}

// A wall at 10 m with a point every 0.25 m.
PointCloud Wall(float first_x, float last_x) {
  PointCloud cloud;
  for (float x = first_x; x <= last_x; x += 0.25F) {
    for (float y = -2; y <= 2; y += 0.25F) cloud.points.emplace_back(x, y, 10.0F);
  }
  return cloud;
}

TEST(TrueSurface, PointsAreCountedByTheViewsThatSeeThem) {
  // Seen by both views, by the right one alone, by neither; behind the wall; behind the camera; and
  // one at the wall's back, within two spacings of it.
  PointCloud cloud;
  cloud.points = {{0, 0, 10}, {2.5F, 0, 10}, {9, 0, 10}, {0, 0, 12}, {0, 0, -10}, {0, 0, 10.4F}};
  const std::vector<std::uint32_t> counts =
      CountViews(cloud, 0.25, 2, [](std::size_t i) { return ViewOfWall(i == 0 ? 0 : 1); });
  EXPECT_EQ(counts, (std::vector<std::uint32_t>{2, 1, 0, 0, 0, 2}));
}

TEST(TrueSurface, NothingIsSeenWhereAViewHasNoDepth) {
  PointCloud cloud;
  cloud.points = {{0, 0, 10}};
  EXPECT_EQ(CountViews(cloud, 0.25, 1, [](std::size_t) { return ViewOfWall(0, 0); }),
            std::vector<std::uint32_t>{0});
}

TEST(TrueSurface, CompletenessCountsOnlyWhatEnoughViewsSee) {
  const std::vector<double> distances = {0.1, 0.1, 0.9, 0.9};
  const std::vector<std::uint32_t> views = {5, 2, 5, 0};
  EXPECT_DOUBLE_EQ(CompletenessOfSeen(distances, views, 0, 0.5), 0.5);
  EXPECT_DOUBLE_EQ(CompletenessOfSeen(distances, views, 1, 0.5), 2.0 / 3);
  EXPECT_DOUBLE_EQ(CompletenessOfSeen(distances, views, 5, 0.5), 0.5);
  EXPECT_DOUBLE_EQ(CompletenessOfSeen(distances, views, 6, 0.5), 0);
  EXPECT_THROW((void)CompletenessOfSeen(distances, {}, 1, 0.5), Error);
}

TEST(TrueSurface, ACloudThatHoldsAllThatViewsShowStaysAsItIs) {
  const PointCloud wall = Wall(-2, 2);
  const PointCloud complete = CompleteTrueCloud(wall, 1, [](std::size_t) { return ViewOfWall(0); });
  EXPECT_EQ(complete.points, wall.points);
}

TEST(TrueSurface, WhatTheCloudLacksIsAddedAtAboutItsSpacing) {
  const PointCloud half = Wall(-2, 0);
  const PointCloud complete = CompleteTrueCloud(half, 1, [](std::size_t) { return ViewOfWall(0); });
  ASSERT_GT(complete.size(), half.size());
  for (std::size_t i = half.size(); i < complete.size(); ++i) {
    EXPECT_GT(complete.points[i].x(), 0.25) << "only where there was nothing";
    EXPECT_FLOAT_EQ(complete.points[i].z(), 10);
  }
  // Every place that the view shows has a point within two spacings and a half, as the header says.
  const std::vector<double> thresholds = {0.25 * 2.5};
  EXPECT_DOUBLE_EQ(ComputeCloudError(complete, Wall(-2, 2), thresholds).shares[0].completeness, 1);
}

TEST(TrueSurface, WhatIsCoarserThanTheCloudAddsNothing) {
  // Neighbouring pixels are 0.5 m apart at 50 m, the points of the cloud 0.25 m.
  const PointCloud wall = Wall(-2, 2);
  EXPECT_EQ(CompleteTrueCloud(wall, 1, [](std::size_t) { return ViewOfWall(0, 50); }).size(),
            wall.size());
}

TEST(TrueSurface, IsRenderedFromTheCloudWithTheNearestPointInFront) {
  PointCloud cloud = Wall(-3, 3);
  cloud.points.emplace_back(0.0F, 0.0F, 5.0F);
  const cv::Mat depth = RenderTrueDepth(cloud, 0.25, SurfaceCamera(), PoseAt(0));
  EXPECT_EQ(cv::countNonZero(depth), 41 * 41) << "the wall closes";
  EXPECT_EQ(depth.at<float>(20, 20), 5);
  // 0.25 m are five pixels at 5 m.
  EXPECT_EQ(depth.at<float>(20, 25), 5);
  EXPECT_EQ(depth.at<float>(20, 26), 10);
  const std::vector<std::uint32_t> counts = CountViews(cloud, 0.25, 1, [&](std::size_t) {
    return TrueView{SurfaceCamera(), PoseAt(0), depth};
  });
  EXPECT_EQ(counts.back(), 1U);
}

TEST(TrueSurface, RefusesWhatIsNoView) {
  const PointCloud wall = Wall(-2, 2);
  TrueView view = ViewOfWall(0);
  view.depth = cv::Mat(4, 5, CV_32FC1, cv::Scalar(10));
  EXPECT_THROW((void)CountViews(wall, 0.25, 1, [&](std::size_t) { return view; }), Error);
  EXPECT_THROW((void)CompleteTrueCloud(wall, 1, [&](std::size_t) { return view; }), Error);
  view = ViewOfWall(0);
  view.camera.distortion[0] = 0.1;
  EXPECT_THROW((void)CountViews(wall, 0.25, 1, [&](std::size_t) { return view; }), Error);
  EXPECT_THROW((void)CloudSpacing({}), Error);
}

}  // namespace
}  // namespace mono3d
