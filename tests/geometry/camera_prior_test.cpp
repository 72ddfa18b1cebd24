// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/camera_prior.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "mono3d/core/error.h"
#include "mono3d/geometry/distortion.h"

namespace mono3d {
namespace {

CameraModel WideCamera() {
  return {.width = 1000,
          .height = 750,
          .fx = 700,
          .fy = 702,
          .cx = 505,
          .cy = 370,
          .distortion = {-0.1, 0.02, 1e-4, 0, 0}};
}

// The ray of the corner that is farthest from the principal point of WideCamera.
Eigen::Vector3d CornerRay(const CameraModel& camera) { return camera.Unproject({0, 749}); }

TEST(CameraPrior, OfAnUnknownCameraIsAPinholeInTheMiddle) {
  const CameraPrior prior = DefaultCameraPrior(768, 432);
  EXPECT_EQ(prior.camera,
            (CameraModel{
                .width = 768, .height = 432, .fx = 691.2, .fy = 691.2, .cx = 383.5, .cy = 215.5}));
  EXPECT_EQ(prior.focal_sigma, 0.3);
  EXPECT_EQ(prior.aspect_sigma, 0) << "pixels are square";
  EXPECT_EQ(prior.source, CameraPriorSource::kDefault);
  EXPECT_NO_THROW(Validate(prior, "test"));
}

TEST(CameraPrior, OfAnUnknownFisheyeLensSpansItsProjections) {
  const CameraPrior prior = DefaultCameraPrior(1000, 700, LensModel::kFisheye);
  EXPECT_EQ(prior.camera.lens, LensModel::kFisheye);
  EXPECT_NO_THROW(Validate(prior, "test"));
  // 130 degrees from the middle of the left border to that of the right one.
  const double half = 65 * std::numbers::pi / 180;
  EXPECT_NEAR(
      ProjectDistorted(prior.camera, {std::sin(half), 0, std::cos(half)}).x() - prior.camera.cx,
      500, 1e-9);
  EXPECT_EQ(prior.distortion_sigma[4], 0) << "there are four coefficients";
  const double k1_of_equal_solid_angles = -1. / 24;
  const double k1_of_stereographic = 1. / 12;
  for (const double k1 : {k1_of_equal_solid_angles, k1_of_stereographic}) {
    EXPECT_LT(std::abs(k1), 2 * prior.distortion_sigma[0]);
  }
}

TEST(CameraPrior, OfAFisheyeCalibrationIsTrustedToPixelsInTheCorners) {
  CameraModel camera = WideCamera();
  camera.lens = LensModel::kFisheye;
  camera.fx = camera.fy = 400;
  camera.distortion = {0.02, -0.01, 0.002, 0, 0};
  const CameraPrior prior = CalibratedCameraPrior(camera);
  const double radius = std::hypot(505, 379) / 400;
  const double theta = FisheyeAngles(camera.distortion).At(radius).value();
  const Eigen::Vector3d corner(std::sin(theta), 0, std::cos(theta));
  for (std::size_t i = 0; i < 4; ++i) {
    CameraModel other = camera;
    other.distortion[i] += prior.distortion_sigma[i];
    EXPECT_NEAR((ProjectDistorted(other, corner) - ProjectDistorted(camera, corner)).norm(), 1.5,
                1e-6);
  }
  EXPECT_EQ(prior.distortion_sigma[4], 0);
}

TEST(CameraPrior, OfAnUnknownCameraIsTheSameTurned) {
  const CameraPrior wide = DefaultCameraPrior(4000, 3000);
  const CameraPrior tall = DefaultCameraPrior(3000, 4000);
  EXPECT_EQ(wide.camera.fx, tall.camera.fx);
  EXPECT_EQ(wide.principal_point_sigma_px, tall.principal_point_sigma_px);
}

// Calibrations of real cameras, of which an unknown one may be: each parameter within 2.5 standard
// deviations.
TEST(CameraPrior, OfAnUnknownCameraCoversRealOnes) {
  const CameraModel cameras[] = {
      // A Phantom 4 RTK and a Mavic 3E, as their maker calibrated them (published DewarpData).
      {5472,
       3648,
       3678.87,
       3671.84,
       2745.6,
       1850.79,
       {-0.268652, 0.114663, 1.5e-5, -4.6e-5, -0.035026}},
      {5280,
       3956,
       3713.29,
       3713.29,
       2646.52,
       1968.78,
       {-0.112575, 0.014874, -8.6e-5, 1e-7, -0.027064}},
      {768, 512, 689.87, 691.04, 379.7975, 251.3275, {}},
      {768, 432, 537.47, 537.47, 383.5, 215.5, {0.03997, 0, 0, 0, 0}}};
  for (const CameraModel& camera : cameras) {
    const CameraPrior prior = DefaultCameraPrior(camera.width, camera.height);
    const double n = 2.5;
    EXPECT_LT(std::abs(camera.fx / prior.camera.fx - 1), n * prior.focal_sigma);
    EXPECT_LT(std::abs(camera.cx - prior.camera.cx), n * prior.principal_point_sigma_px);
    EXPECT_LT(std::abs(camera.cy - prior.camera.cy), n * prior.principal_point_sigma_px);
    for (std::size_t i = 0; i < 5; ++i) {
      EXPECT_LT(std::abs(camera.distortion[i]), n * prior.distortion_sigma[i]) << i;
    }
  }
}

TEST(CameraPrior, RefusesASizeOfNothing) {
  EXPECT_THROW(DefaultCameraPrior(0, 10), Error);
  EXPECT_THROW(DefaultCameraPrior(10, -1), Error);
}

TEST(CameraPrior, OfACalibrationIsTheCalibration) {
  const CameraPrior prior = CalibratedCameraPrior(WideCamera());
  EXPECT_EQ(prior.camera, WideCamera());
  EXPECT_EQ(prior.source, CameraPriorSource::kCalibration);
  EXPECT_LE(prior.focal_sigma, 0.01);
  EXPECT_GT(prior.aspect_sigma, 0);
  CameraModel square = WideCamera();
  square.fy = square.fx;
  EXPECT_EQ(CalibratedCameraPrior(square).aspect_sigma, 0);
  CameraModel broken = WideCamera();
  broken.fx = 0;
  EXPECT_THROW(CalibratedCameraPrior(broken), Error);
}

// One standard deviation of any parameter but the focal length moves the corner by 1.5 px of 1000.
TEST(CameraPrior, OfACalibrationIsTrustedToAPixelOrTwoInTheCorners) {
  const CameraPrior prior = CalibratedCameraPrior(WideCamera());
  EXPECT_NEAR(prior.principal_point_sigma_px, 1.5, 1e-9);
  CameraModel straight = WideCamera();
  straight.distortion = {};
  const Eigen::Vector3d ray = CornerRay(straight);
  for (std::size_t i = 0; i < 5; ++i) {
    CameraModel changed = straight;
    changed.distortion[i] = prior.distortion_sigma[i];
    const double moved_px =
        (ProjectDistorted(changed, ray) - ProjectDistorted(straight, ray)).norm();
    EXPECT_LT(moved_px, 1.6) << i;
    EXPECT_GT(moved_px, 0.8) << i;  // tangential terms do less than their most in this corner
  }
}

// The corner of a narrow view says nothing of its lens.
TEST(CameraPrior, OfACalibrationIsNoWorseThanOfAnUnknownLens) {
  CameraModel tele = WideCamera();
  tele.fx = tele.fy = 8000;
  const CameraPrior told = CalibratedCameraPrior(tele);
  const CameraPrior unknown = DefaultCameraPrior(tele.width, tele.height);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_LE(told.distortion_sigma[i], unknown.distortion_sigma[i]) << i;
  }
}

TEST(CameraPrior, ResizedChangesWhatIsInPixels) {
  const CameraPrior prior = CalibratedCameraPrior(WideCamera());
  const CameraPrior half = prior.Resized(500, 375);
  EXPECT_EQ(half.camera, WideCamera().Resized(500, 375));
  EXPECT_EQ(half.focal_sigma, prior.focal_sigma);
  EXPECT_DOUBLE_EQ(half.principal_point_sigma_px, prior.principal_point_sigma_px / 2);
  EXPECT_EQ(half.distortion_sigma, prior.distortion_sigma);
  EXPECT_EQ(half.description, prior.description);
}

TEST(CameraPrior, WithoutStandardDeviationsIsRefused) {
  CameraPrior prior = DefaultCameraPrior(80, 60);
  prior.focal_sigma = -1;
  EXPECT_THROW(Validate(prior, "test"), Error);
  prior = DefaultCameraPrior(80, 60);
  prior.distortion_sigma[3] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(Validate(prior, "test"), Error);
  prior = DefaultCameraPrior(80, 60);
  prior.camera.fx = 0;
  EXPECT_THROW(Validate(prior, "test"), Error);
}

TEST(CameraPrior, NamesItsSource) {
  EXPECT_STREQ(ToString(CameraPriorSource::kCalibration), "calibration");
  EXPECT_STREQ(ToString(CameraPriorSource::kXmp), "XMP");
  EXPECT_STREQ(ToString(CameraPriorSource::kExif), "EXIF");
  EXPECT_STREQ(ToString(CameraPriorSource::kVideo), "video");
  EXPECT_STREQ(ToString(CameraPriorSource::kDefault), "default");
}

}  // namespace
}  // namespace mono3d
