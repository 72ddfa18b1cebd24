// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>

#include "mono3d/core/error.h"
#include "mono3d/geometry/distortion.h"
#include "mono3d/image/undistorter.h"

namespace mono3d {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr double kDegree = std::numbers::pi / 180;

CameraModel FisheyeOf(double degrees_across, const std::array<double, 5>& distortion) {
  CameraModel camera{160, 120, 0, 0, 78.5, 61.25, distortion};
  camera.fx = 160 / FisheyeRadius(distortion, 0.5 * degrees_across * kDegree) / 2;
  camera.fy = 0.98 * camera.fx;
  camera.lens = LensModel::kFisheye;
  return camera;
}

const CameraModel kFisheyes[] = {FisheyeOf(90, {}), FisheyeOf(120, {0.03, -0.02, 0.01, -0.002, 0}),
                                 FisheyeOf(150, {-0.04, 0.001, 0, 0, 0}), FisheyeOf(195, {})};

double Angle(const CameraModel& camera, double x, double y) {
  const Eigen::Vector3d ray = camera.Unproject({x, y});
  return std::atan2(ray.head<2>().norm(), ray.z());
}

double LargestCornerAngle(const CameraModel& camera) {
  return std::max({Angle(camera, 0, 0), Angle(camera, camera.width - 1, 0),
                   Angle(camera, 0, camera.height - 1),
                   Angle(camera, camera.width - 1, camera.height - 1)});
}

double SlowBrightness(const Eigen::Vector2d& pixel) {
  return 127 + 60 * std::sin(pixel.x() / 20) + 60 * std::cos(pixel.y() / 20);
}

TEST(FisheyeUndistortion, GivesEachPixelTheBrightnessOfItsDirection) {
  for (const CameraModel& fisheye : kFisheyes) {
    cv::Mat image(fisheye.height, fisheye.width, CV_8UC1);
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) {
        image.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(SlowBrightness({x, y}));
      }
    }
    const Undistorter undistorter(fisheye);
    const cv::Mat straight = undistorter.Undistort(image);
    for (int y = 0; y < straight.rows; ++y) {
      for (int x = 0; x < straight.cols; ++x) {
        const Eigen::Vector2d seen =
            ProjectDistorted(fisheye, undistorter.camera().Unproject({x, y}));
        ASSERT_TRUE(fisheye.Contains(seen, -0.02)) << seen.transpose();
        // As for other lenses: rounding to whole levels, and of the maps.
        ASSERT_NEAR(straight.at<std::uint8_t>(y, x), SlowBrightness(seen), 1.2) << x << " " << y;
      }
    }
  }
}

TEST(FisheyeUndistortion, EndsSixtyDegreesOffTheAxisOrWithTheImage) {
  for (const CameraModel& fisheye : kFisheyes) {
    const CameraModel straight = Undistorter(fisheye).camera();
    EXPECT_FALSE(straight.HasDistortion());
    EXPECT_EQ(straight.width, fisheye.width);
    EXPECT_EQ(straight.height, fisheye.height);
    EXPECT_EQ(straight.fx, straight.fy);
    EXPECT_LT(LargestCornerAngle(straight), 60.01 * kDegree);
  }
  // The middle keeps its resolution nearly, whatever the lens shows beside.
  for (const double degrees : {110., 130., 150., 170., 190.}) {
    const CameraModel fisheye = FisheyeOf(degrees, {});
    const CameraModel straight = Undistorter(fisheye).camera();
    EXPECT_GT(straight.fx, 0.75 * fisheye.fx) << degrees;
    EXPECT_LT(straight.fx, 1.25 * fisheye.fx) << degrees;
    EXPECT_GT(LargestCornerAngle(straight), 55 * kDegree) << degrees;
  }
}

TEST(FisheyeUndistortion, KeepsTheShutterOut) {
  CameraModel fisheye = kFisheyes[2];
  fisheye.shutter.readout_s = 0.02;
  EXPECT_TRUE(Undistorter(fisheye).camera().shutter.IsGlobal());
}

TEST(FisheyeUndistortion, RefusesALensThatFoldsBackWhereItIsUsed) {
  CameraModel folding = FisheyeOf(150, {});
  folding.distortion = {-1. / 3, 0, 0, 0, 0};  // beyond 57 degrees
  EXPECT_THAT([&] { Undistorter{folding}; },
              ThrowsMessage<Error>(HasSubstr("distortion coefficients do not describe a lens")));
  folding.distortion = {-0.2, 0, 0, 0, 0};  // beyond 74 degrees, which are not shown
  EXPECT_NO_THROW(Undistorter{folding});
}

}  // namespace
}  // namespace mono3d
