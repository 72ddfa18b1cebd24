// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/vignetting.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "fusion/registration_scene.h"

namespace mono3d {
namespace {

constexpr double kCornerFalloff = 0.8;  // of grey values: some 40 % of the light are lost

double RadiusSquareOf(const CameraModel& camera, int x, int y) {
  const double dx = x - camera.cx;
  const double dy = y - camera.cy;
  return (dx * dx + dy * dy) / (camera.cx * camera.cx + camera.cy * camera.cy);
}

// As a lens loses light in the square of the radius.
cv::Mat Darkened(const cv::Mat& bgr, const CameraModel& camera, double corner, double gain) {
  cv::Mat darkened = bgr.clone();
  for (int y = 0; y < bgr.rows; ++y) {
    for (int x = 0; x < bgr.cols; ++x) {
      const double share = gain * (1 - (1 - corner) * RadiusSquareOf(camera, x, y));
      for (int channel = 0; channel < 3; ++channel) {
        auto& value = darkened.at<cv::Vec3b>(y, x)[channel];
        value = cv::saturate_cast<std::uint8_t>(share * value);
      }
    }
  }
  return darkened;
}

// A flight over flat ground, each image of which has another gain.
Vignetting Learned(double corner, int num_views) {
  HouseScene scene;
  scene.with_house = false;
  Vignetting vignetting;
  for (int i = 0; i < num_views; ++i) {
    TrackedMap view = HouseViewFrom(scene, PoseOver(1.5 * i, 0.7 * (i % 3)));
    view.bgr = Darkened(view.bgr, view.camera, corner, i % 2 == 0 ? 1 : 0.75);
    vignetting.Add(view, Similarity(1, view.T_world_cam));
  }
  return vignetting;
}

TEST(Vignetting, IsLearnedWhateverTheExposure) {
  const Vignetting vignetting = Learned(kCornerFalloff, 12);
  ASSERT_TRUE(vignetting.IsKnown());
  const CameraModel camera = HouseCamera();
  for (const auto& [x, y] : {std::pair{0, 0}, {30, 20}, {72, 48}, {120, 90}}) {
    const double expected = 1 - (1 - kCornerFalloff) * RadiusSquareOf(camera, x, y);
    EXPECT_NEAR(vignetting.FalloffAt(camera, x, y), expected, 0.02) << x << " " << y;
  }
}

TEST(Vignetting, IsNotFoundWhereThereIsNone) {
  const Vignetting vignetting = Learned(1, 12);
  EXPECT_FALSE(vignetting.IsKnown());
  const TrackedMap view = HouseView({}, 0);
  EXPECT_EQ(vignetting.Corrected(view.bgr, view.camera).data, view.bgr.data);
}

TEST(Vignetting, IsNotKnownOfCamerasThatDoNotMove) {
  Vignetting vignetting;
  TrackedMap view = HouseView({}, 0);
  view.bgr = Darkened(view.bgr, view.camera, kCornerFalloff, 1);
  for (int i = 0; i < 5; ++i) vignetting.Add(view, Similarity(1, view.T_world_cam));
  EXPECT_FALSE(vignetting.IsKnown());
}

TEST(Vignetting, IsTakenOutOfImagesAndClippedValuesStay) {
  const Vignetting vignetting = Learned(kCornerFalloff, 12);
  const CameraModel camera = HouseCamera();
  cv::Mat bgr(camera.height, camera.width, CV_8UC3, cv::Scalar::all(200));
  bgr = Darkened(bgr, camera, kCornerFalloff, 1);
  bgr.at<cv::Vec3b>(0, 0) = cv::Vec3b(255, 0, 240);
  const cv::Mat corrected = vignetting.Corrected(bgr, camera);
  EXPECT_EQ(corrected.at<cv::Vec3b>(0, 0), cv::Vec3b(255, 0, 255));
  cv::Mat off;
  cv::absdiff(corrected, cv::Scalar::all(200), off);
  off.at<cv::Vec3b>(0, 0) = cv::Vec3b(0, 0, 0);
  double worst = 0;
  cv::minMaxLoc(off.reshape(1), nullptr, &worst);
  EXPECT_LE(worst, 6);
}

}  // namespace
}  // namespace mono3d
