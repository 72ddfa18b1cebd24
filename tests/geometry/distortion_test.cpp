// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/distortion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <vector>

#include "reference/random.h"

namespace mono3d {
namespace {

constexpr double kRounding_px = 1e-12;  // px; a few operations in double precision

CameraModel DistortedCamera() {
  return {.width = 80, .height = 60, .fx = 100, .fy = 110, .cx = 39.5, .cy = 29.5};
}

TEST(ProjectDistorted, IsProjectWithoutDistortion) {
  const Eigen::Vector3d p_cam(1, -0.5, 2);
  EXPECT_EQ(ProjectDistorted(DistortedCamera(), p_cam), DistortedCamera().Project(p_cam));
}

TEST(ProjectDistorted, IsWorkedOutByHand) {
  // x = 0.5, y = 1, r2 = 1.25.
  const Eigen::Vector3d p_cam(1, 2, 2);
  CameraModel camera = DistortedCamera();
  camera.distortion = {0.1, 0.2, 0, 0, 0.4};
  // 1 + 0.1 * 1.25 + 0.2 * 1.5625 + 0.4 * 1.953125 = 2.21875
  EXPECT_LT((ProjectDistorted(camera, p_cam) -
             Eigen::Vector2d(100 * 0.5 * 2.21875 + 39.5, 110 * 2.21875 + 29.5))
                .norm(),
            kRounding_px * 1000);
  camera.distortion = {0, 0, 0.01, 0.02, 0};
  // dx = 2 * 0.01 * 0.5 + 0.02 * (1.25 + 0.5), dy = 0.01 * (1.25 + 2) + 2 * 0.02 * 0.5
  EXPECT_LT((ProjectDistorted(camera, p_cam) -
             Eigen::Vector2d(100 * (0.5 + 0.045) + 39.5, 110 * (1 + 0.0525) + 29.5))
                .norm(),
            kRounding_px * 1000);
}

constexpr double kPi = std::numbers::pi;

CameraModel FisheyeCamera() {
  CameraModel camera = DistortedCamera();
  camera.distortion = {0.03, -0.02, 0.011, -0.002, 0};
  camera.lens = LensModel::kFisheye;
  return camera;
}

TEST(ProjectFisheye, IsThatOfOpenCv) {
  std::mt19937 random(SeedFromTestName());
  const CameraModel camera = FisheyeCamera();
  const cv::Matx33d K(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
  const cv::Vec4d coefficients(0.03, -0.02, 0.011, -0.002);
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d p(Uniform(random, -4, 4), Uniform(random, -4, 4), 1);
    std::vector<cv::Point2d> pixels;
    cv::fisheye::projectPoints(std::vector<cv::Point3d>{{p.x(), p.y(), p.z()}}, pixels, cv::Vec3d(),
                               cv::Vec3d(), K, coefficients);
    const Eigen::Vector2d pixel = ProjectDistorted(camera, 3 * p);
    EXPECT_NEAR(pixel.x(), pixels[0].x, 1e-9);
    EXPECT_NEAR(pixel.y(), pixels[0].y, 1e-9);
  }
}

TEST(ProjectFisheye, GoesOnBeyondARightAngle) {
  CameraModel camera = FisheyeCamera();
  EXPECT_EQ(ProjectDistorted(camera, {0, 0, 3}), Eigen::Vector2d(39.5, 29.5));
  camera.distortion = {};
  EXPECT_LT((ProjectDistorted(camera, {2, 0, 0}) - Eigen::Vector2d(50 * kPi + 39.5, 29.5)).norm(),
            1000 * kRounding_px);
  EXPECT_LT(
      (ProjectDistorted(camera, {0, -1, -1}) - Eigen::Vector2d(39.5, 29.5 - 82.5 * kPi)).norm(),
      1000 * kRounding_px);
}

TEST(FisheyeAngles, InvertTheRadius) {
  const CameraModel camera = FisheyeCamera();
  const FisheyeAngles angles(camera.distortion);
  EXPECT_GT(angles.largest(), 0.5 * kPi);
  for (const double theta : {0., 1e-9, 0.01, 0.4321, 1.2, 0.5 * kPi, angles.largest() - 1e-6}) {
    const std::optional<double> found = angles.At(FisheyeRadius(camera.distortion, theta));
    ASSERT_TRUE(found) << theta;
    EXPECT_NEAR(*found, theta, 1e-12);
  }
  EXPECT_FALSE(angles.At(FisheyeRadius(camera.distortion, angles.largest()) + 1e-6));
  EXPECT_FALSE(angles.At(-1e-6));
}

TEST(FisheyeAngles, EndWhereTheLensFoldsBack) {
  // theta - theta^3 / 3 grows up to 1.
  const FisheyeAngles angles({-1. / 3, 0, 0, 0, 0});
  EXPECT_NEAR(angles.largest(), 0.99, 1e-9);
  EXPECT_TRUE(angles.At(0.66));
  EXPECT_FALSE(angles.At(0.67));
  EXPECT_NEAR(FisheyeAngles({}).largest(), kPi, 0.01);
}

}  // namespace
}  // namespace mono3d
