// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/image/common_camera.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/geometry/distortion.h"
#include "mono3d/image/frame.h"
#include "mono3d/image/undistorter.h"

namespace mono3d {
namespace {

const CameraModel kWide{160, 120, 110, 110, 79.5, 59.5, {}};
const CameraModel kUpright{120, 160, 110, 110, 59.5, 79.5, {}};
const CameraModel kBent{150, 130, 140, 139, 70, 66, {-0.15, 0.03, 0.001, -0.002, 0}};

TEST(CommonCamera, OfOneCameraIsItsOwn) {
  const CameraModel common = CommonCamera(std::vector<PhotosOfCamera>{{kWide, 3}});
  EXPECT_EQ(common, kWide);
}

TEST(CommonCamera, HoldsUprightAndWidePhotosAtTheirOwnScale) {
  const CameraModel common = CommonCamera(std::vector<PhotosOfCamera>{{kWide, 3}, {kUpright, 2}});
  EXPECT_EQ(common.width, 160);
  EXPECT_EQ(common.height, 160);
  EXPECT_NEAR(common.fx, 110, 1e-9);
  EXPECT_EQ(Undistorter(kWide, common).content(), cv::Rect(0, 20, 160, 120));
  EXPECT_EQ(Undistorter(kUpright, common).content(), cv::Rect(20, 0, 120, 160));
}

TEST(CommonCamera, HasTheFocalLengthOfMostPhotos) {
  CameraModel longer = kWide;
  longer.fx = longer.fy = 130;
  EXPECT_NEAR(CommonCamera(std::vector<PhotosOfCamera>{{kWide, 2}, {longer, 3}}).fx, 130, 1e-9);
  EXPECT_NEAR(CommonCamera(std::vector<PhotosOfCamera>{{kWide, 3}, {longer, 2}}).fx, 110, 1e-9);
}

TEST(CommonCamera, IsNoLargerThanTwiceTheLargestPhoto) {
  CameraModel tele = kWide;
  tele.fx = tele.fy = 440;
  const CameraModel common = CommonCamera(std::vector<PhotosOfCamera>{{kWide, 1}, {tele, 5}});
  EXPECT_LE(common.width * common.height, 2 * 160 * 120);
  EXPECT_GT(common.width * common.height, 1.9 * 160 * 120);
  EXPECT_EQ(Undistorter(kWide, common).content(), cv::Rect(0, 0, common.width, common.height));
  const CameraModel limited =
      CommonCamera(std::vector<PhotosOfCamera>{{kWide, 1}, {tele, 5}}, 100, 60);
  EXPECT_LE(limited.width, 100);
  EXPECT_LE(limited.height, 60);
  EXPECT_GE(limited.height, 59);
}

TEST(CommonCamera, OfNoCameraIsAnError) {
  EXPECT_THROW((void)CommonCamera(std::vector<PhotosOfCamera>{}), Error);
}

// Brightness by place: slow enough for linear interpolation to be exact to a level.
double PatternAt(const Eigen::Vector2d& pixel) {
  return 127 + 60 * std::sin(pixel.x() / 20) + 60 * std::cos(pixel.y() / 20);
}

TEST(UndistorterIntoACommonCamera, ShowsEachDirectionWithinTheContentAndRepeatsItsBorder) {
  const CameraModel common =
      CommonCamera(std::vector<PhotosOfCamera>{{kUpright, 3}, {kBent, 2}, {kWide, 1}});
  cv::Mat image(kBent.height, kBent.width, CV_8UC1);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      image.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(PatternAt({x, y}));
    }
  }
  const Undistorter undistorter(kBent, common);
  const cv::Mat straight = undistorter.Undistort(image);
  ASSERT_EQ(straight.size(), cv::Size(common.width, common.height));
  const cv::Rect content = undistorter.content();
  EXPECT_LT(content.area(), straight.size().area());
  EXPECT_GT(content.area(), 0.4 * straight.size().area());
  for (int y = 0; y < straight.rows; ++y) {
    for (int x = 0; x < straight.cols; ++x) {
      const int u = std::clamp(x, content.x, content.br().x - 1);
      const int v = std::clamp(y, content.y, content.br().y - 1);
      EXPECT_EQ(straight.at<std::uint8_t>(y, x), straight.at<std::uint8_t>(v, u));
      const Eigen::Vector2d pixel = ProjectDistorted(kBent, common.Unproject({u, v}));
      EXPECT_TRUE(kBent.Contains(pixel, -0.03)) << u << " " << v;
      EXPECT_NEAR(straight.at<std::uint8_t>(v, u), PatternAt(pixel), 2);
    }
  }
  EXPECT_THROW((void)undistorter.Undistort(straight), Error) << "an image of another size";
}

TEST(FrameContent, IsAllUnlessToldOtherwise) {
  Frame frame;
  frame.camera = kWide;
  EXPECT_EQ(frame.ContentOrAll(), cv::Rect(0, 0, 160, 120));
  EXPECT_TRUE(frame.Shows({0, 119}));
  EXPECT_FALSE(frame.Shows({160, 3}));
  frame.content = {10, 20, 30, 40};
  EXPECT_TRUE(frame.Shows({10, 59}));
  EXPECT_FALSE(frame.Shows({9.5, 59}));
  EXPECT_FALSE(frame.Shows({12, 59.5}));
  frame.bgr = cv::Mat::zeros(120, 160, CV_8UC3);
  EXPECT_NO_THROW(Validate(frame));
  frame.content = {140, 20, 30, 40};
  EXPECT_THROW(Validate(frame), Error);
}

}  // namespace
}  // namespace mono3d
