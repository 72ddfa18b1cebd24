// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "drawing/cloud_picture.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/LU>
#include <limits>
#include <opencv2/core.hpp>
#include <vector>

#include "drawing/cloud_renderer.h"
#include "evaluation/cloud_scenes.h"
#include "mono3d/core/error.h"
#include "mono3d/evaluation/cloud_transform.h"

namespace mono3d::tools {
namespace {

constexpr int kWidth_px = 160;
const cv::Vec3b kWhite = {255, 255, 255};
const cv::Vec3b kGreen = {0, 200, 0};
const cv::Vec3b kRed = {0, 0, 200};

// Where the view puts a point, in pixels.
Eigen::Vector2d PixelOf(const CloudView& view, const Eigen::Vector3d& point) {
  const Eigen::Vector3d offset = view.R_view_world * (point - view.centre_world) / view.pixel_su;
  return offset.head<2>() + Eigen::Vector2d(view.size.width, view.size.height) / 2;
}

double ShareOfSurface(const cv::Mat& picture) {
  cv::Mat is_white;
  cv::inRange(picture, cv::Scalar::all(255), cv::Scalar::all(255), is_white);
  return 1 - cv::countNonZero(is_white) / static_cast<double>(picture.total());
}

TEST(CloudViews, LookDownOnTheGroundWithoutBeingTold) {
  for (const bool with_normals : {true, false}) {
    const std::vector<CloudView> views =
        StandardCloudViews(HouseCloud(5000, 1, with_normals), kWidth_px);
    ASSERT_EQ(views.size(), 3U);
    EXPECT_LT(views[0].R_view_world(2, 2), -0.99);  // the view's z is the world's -z
    for (const CloudView& view : views) {
      EXPECT_NEAR(view.R_view_world.determinant(), 1, 1e-9);
      EXPECT_LE(view.size.height, view.size.width);
    }
    for (int side = 1; side < 3; ++side) {  // a roof is above the ground in the pictures
      const CloudView& view = views[static_cast<std::size_t>(side)];
      EXPECT_LT(PixelOf(view, {0, 0, 6.5}).y(), PixelOf(view, {0, 0, 0}).y());
    }
    EXPECT_NEAR(views[1].R_view_world.row(0).dot(views[2].R_view_world.row(0)), 0, 1e-9);
  }
}

TEST(CloudViews, AreNotShrunkByAFewPointsFarOut) {
  PointCloud cloud = HouseCloud(5000, 2);
  const std::vector<CloudView> clean = StandardCloudViews(cloud, kWidth_px);
  for (int i = 0; i < 10; ++i) cloud.points[static_cast<std::size_t>(100 * i)] *= 500.0F;
  const std::vector<CloudView> with_outliers = StandardCloudViews(cloud, kWidth_px);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(with_outliers[i].pixel_su / clean[i].pixel_su, 1, 0.05);
  }
}

TEST(CloudViews, TakeTheGivenUp) {
  const std::vector<CloudView> views =
      StandardCloudViews(HouseCloud(1000, 3), kWidth_px, Eigen::Vector3d(0, 2, 0));
  EXPECT_NEAR(views[0].R_view_world(2, 1), -1, 1e-9);
}

TEST(RenderClouds, ShowsWhatIsNearerAndWhiteWhereNothingIs) {
  PointCloud near_point;
  near_point.points = {{0, 0, 1}};
  near_point.radii = {2};
  PointCloud far_point = near_point;
  far_point.points = {{0, 0, 50}};
  far_point.radii = {6};
  const CloudView view{.name = "along z", .size = {32, 24}};
  const std::vector<CloudLayer> layers = {{.cloud = &near_point, .colour = kGreen},
                                          {.cloud = &far_point, .colour = kRed}};
  const cv::Mat picture = RenderClouds(layers, view);
  ASSERT_EQ(picture.type(), CV_8UC3);
  ASSERT_EQ(picture.size(), view.size);
  EXPECT_EQ(picture.at<cv::Vec3b>(12, 16), kGreen);  // faces the viewer: full light
  EXPECT_EQ(picture.at<cv::Vec3b>(12, 20), kRed);    // 4 px aside: only the larger one
  EXPECT_EQ(picture.at<cv::Vec3b>(12, 26), kWhite);
}

TEST(RenderClouds, ColoursValuesFromLightToDarkRed) {
  PointCloud cloud;
  cloud.points = {{-8, 0, 0}, {8, 0, 0}};
  cloud.radii = {4, 4};
  const std::vector<double> values = {0, 5};  // beyond the end of the scale
  const CloudLayer layer{.cloud = &cloud, .values = values, .max_value = 2};
  const cv::Mat picture = RenderClouds({&layer, 1}, CloudView{.name = "along z", .size = {32, 24}});
  const auto small = picture.at<cv::Vec3b>(12, 8);
  const auto large = picture.at<cv::Vec3b>(12, 24);
  EXPECT_GT(small[1], 200);
  EXPECT_LT(large[1], 50);
  EXPECT_GT(large[2], 2 * large[0]);
}

TEST(RenderClouds, ClosesTheSurfaceOfACloudWithoutRadii) {
  const PointCloud house = HouseCloud(20000, 4);
  const std::vector<CloudView> views = StandardCloudViews(house, 320);
  const CloudLayer layer{.cloud = &house};
  const cv::Mat picture = RenderClouds({&layer, 1}, views[0]);
  const cv::Rect inner(picture.cols / 3, picture.rows / 3, picture.cols / 3, picture.rows / 3);
  EXPECT_GT(ShareOfSurface(picture(inner)), 0.99);
  EXPECT_LT(ShareOfSurface(picture), 0.9);  // the margin is white
}

TEST(CloudPictures, HaveARowForEachView) {
  const PointCloud truth = HouseCloud(3000, 5);
  const PointCloud estimate = HouseCloud(3000, 6, true);
  const std::vector<CloudView> views = StandardCloudViews(truth, kWidth_px);
  int height = 0;
  for (const CloudView& view : views) height += view.size.height;
  const cv::Mat side_by_side = CloudsSideBySide(estimate, truth, views);
  const cv::Mat two_colours = CloudsInTwoColours(estimate, truth, views);
  const std::vector<double> distances(estimate.size(), 0.1);
  const cv::Mat by_distance = CloudByDistance(estimate, distances, 0.5, views, 15.0);
  EXPECT_GT(side_by_side.cols, 2 * kWidth_px);
  EXPECT_EQ(two_colours.cols, kWidth_px);
  EXPECT_GT(side_by_side.rows, height);
  EXPECT_EQ(side_by_side.rows, two_colours.rows);
  EXPECT_GT(by_distance.rows, two_colours.rows);  // the colour bar
  cv::Mat blue;
  cv::inRange(two_colours, cv::Scalar(100, 0, 0), cv::Scalar(255, 200, 90), blue);
  cv::Mat yellow;
  cv::inRange(two_colours, cv::Scalar(0, 100, 120), cv::Scalar(90, 255, 255), yellow);
  // Two drawings of one surface: each in front at about half of it.
  EXPECT_GT(cv::countNonZero(blue), static_cast<int>(two_colours.total() / 20));
  EXPECT_GT(cv::countNonZero(yellow), static_cast<int>(two_colours.total() / 20));
}

TEST(CloudPictures, RefuseWhatTheyCannotShow) {
  const PointCloud house = HouseCloud(100, 7);
  PointCloud broken = house;
  broken.points[5].z() = std::numeric_limits<float>::quiet_NaN();
  const std::vector<double> too_few(99, 0.0);
  const std::vector<double> distances(100, 0.0);
  const std::vector<CloudView> views = StandardCloudViews(house, kWidth_px);
  EXPECT_THROW(StandardCloudViews({}, kWidth_px), Error);
  EXPECT_THROW(StandardCloudViews(broken, kWidth_px), Error);
  EXPECT_THROW(StandardCloudViews(house, 0), Error);
  EXPECT_THROW(CloudsInTwoColours(broken, house, views), Error);
  EXPECT_THROW(CloudByDistance(house, too_few, 1, views), Error);
  EXPECT_THROW(CloudByDistance(house, distances, 0, views), Error);
}

}  // namespace
}  // namespace mono3d::tools
