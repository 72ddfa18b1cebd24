// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/camera_model.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <limits>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

constexpr double kCameraRounding = 1e-12;  // relative; a few operations in double precision

CameraModel SmallCamera() {
  return {.width = 80, .height = 60, .fx = 100, .fy = 110, .cx = 39.5, .cy = 29.5};
}

TEST(CameraModel, ProjectsByHand) {
  // x = 100 * 1/2 + 39.5, y = 110 * -0.5/2 + 29.5
  EXPECT_EQ(SmallCamera().Project({1, -0.5, 2}), Eigen::Vector2d(89.5, 2));
}

TEST(CameraModel, UnprojectInvertsProject) {
  const Eigen::Vector2d pixel(12.25, 51);
  const Eigen::Vector3d ray = SmallCamera().Unproject(pixel);
  EXPECT_EQ(ray.z(), 1);
  EXPECT_LT((SmallCamera().Project(7 * ray) - pixel).norm(), 80 * kCameraRounding);
  EXPECT_LT((SmallCamera().Matrix() * ray - pixel.homogeneous()).norm(), 80 * kCameraRounding);
}

TEST(CameraModel, ContainsThePixelCentres) {
  const CameraModel camera = SmallCamera();
  EXPECT_TRUE(camera.Contains({0, 0}));
  EXPECT_TRUE(camera.Contains({79, 59}));
  EXPECT_FALSE(camera.Contains({79.5, 30}));
  EXPECT_FALSE(camera.Contains({30, -0.1}));
  EXPECT_FALSE(camera.Contains({2, 30}, 3));
  EXPECT_FALSE(camera.Contains({std::numeric_limits<double>::quiet_NaN(), 30}));
}

TEST(CameraModel, ResizedMovesPixelCentresWithTheImage) {
  const CameraModel half = SmallCamera().Resized(40, 30);
  EXPECT_EQ(half.width, 40);
  EXPECT_EQ(half.fx, 50);
  EXPECT_EQ(half.cx, 19.5);  // (39.5 + 0.5) / 2 - 0.5
  // The corner between the four top-left pixels is the centre of the top-left pixel of the half.
  const Eigen::Vector3d ray = SmallCamera().Unproject({0.5, 0.5});
  EXPECT_LT(half.Project(ray).norm(), 80 * kCameraRounding);
}

TEST(CameraModel, ValidateRefusesWhatIsNoCamera) {
  EXPECT_NO_THROW(Validate(SmallCamera(), "test"));
  const auto broken = [](auto change) {
    CameraModel camera = SmallCamera();
    change(camera);
    return camera;
  };
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(Validate(broken([](CameraModel& c) { c.width = 0; }), "test"), Error);
  EXPECT_THROW(Validate(broken([](CameraModel& c) { c.height = -1; }), "test"), Error);
  EXPECT_THROW(Validate(broken([](CameraModel& c) { c.fx = 0; }), "test"), Error);
  EXPECT_THROW(Validate(broken([&](CameraModel& c) { c.fy = kNaN; }), "test"), Error);
  EXPECT_THROW(Validate(broken([&](CameraModel& c) { c.cx = kNaN; }), "test"), Error);
  EXPECT_THROW(Validate(broken([&](CameraModel& c) { c.distortion[4] = kNaN; }), "test"), Error);
}

TEST(CameraModel, KnowsWhetherItDistorts) {
  CameraModel camera = SmallCamera();
  EXPECT_FALSE(camera.HasDistortion());
  camera.distortion[1] = 1e-3;
  EXPECT_TRUE(camera.HasDistortion());
}

TEST(CameraModel, OfAFisheyeLensHasDistortionWithoutCoefficients) {
  CameraModel camera = SmallCamera();
  camera.lens = LensModel::kFisheye;
  EXPECT_TRUE(camera.HasDistortion());
  EXPECT_NE(camera, SmallCamera());
  EXPECT_EQ(camera.Resized(40, 30).lens, LensModel::kFisheye);
  EXPECT_EQ(camera.WithoutDistortion(), SmallCamera());
  EXPECT_NO_THROW(Validate(camera, "test"));
  camera.distortion[4] = 0.1;
  EXPECT_THROW(Validate(camera, "test"), Error) << "it has four coefficients";
}

}  // namespace
}  // namespace mono3d
