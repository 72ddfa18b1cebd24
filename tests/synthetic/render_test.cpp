// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/render.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/core/utility.hpp>

#include "mono3d/core/error.h"
#include "synthetic/flight.h"
#include "synthetic/test_scenes.h"

namespace mono3d::synthetic {
namespace {

const CameraModel kRenderCamera{160, 96, 144, 144, 79.5, 47.5};

// Rays and hits are in single precision, at coordinates of some 100 m.
constexpr double kRelativeDepthError = 1e-5;

int CountDifferentBytes(const cv::Mat& a, const cv::Mat& b) {
  return cv::countNonZero(a.reshape(1) != b.reshape(1));
}

TEST(Render, DepthOfATiltedPlaneIsThatOfTheFormula) {
  PlaneOptions plane;
  plane.normal = Eigen::Vector3d(0.2, -0.3, 1);
  plane.point = Eigen::Vector3d(1, 2, 3);
  plane.half_extent_m = 2000;
  const Pose T_world_cam = LookAt({20, -40, 60}, {0, 0, 0});
  const Rendering rendering = Render(BuildPlane(plane), kRenderCamera, T_world_cam);
  ASSERT_EQ(rendering.depth.type(), CV_32FC1);
  for (int y = 0; y < kRenderCamera.height; ++y) {
    for (int x = 0; x < kRenderCamera.width; ++x) {
      const Eigen::Vector3d ray =
          T_world_cam.rotation() * kRenderCamera.Unproject(Eigen::Vector2d(x, y));
      const double depth_m =
          plane.normal.dot(plane.point - T_world_cam.translation()) / plane.normal.dot(ray);
      ASSERT_NEAR(rendering.depth.at<float>(y, x), depth_m, kRelativeDepthError * depth_m);
    }
  }
}

TEST(Render, BoxStandsOnThePlane) {
  PlaneAndBoxOptions options;
  const Pose T_world_cam = LookAt({0, -30, 40}, {0, 0, 8});
  const Rendering rendering = Render(BuildPlaneAndBox(options), kRenderCamera, T_world_cam);
  int num_on_top = 0;
  int num_on_plane = 0;
  for (int y = 0; y < kRenderCamera.height; ++y) {
    for (int x = 0; x < kRenderCamera.width; ++x) {
      const double depth_m = rendering.depth.at<float>(y, x);
      const Eigen::Vector3d p =
          T_world_cam * Eigen::Vector3d(depth_m * kRenderCamera.Unproject(Eigen::Vector2d(x, y)));
      constexpr double kOnSurface_m = 1e-3;
      EXPECT_GT(p.z(), -kOnSurface_m);
      EXPECT_LT(p.z(), options.box_size_m.z() + kOnSurface_m);
      if (std::abs(p.z() - options.box_size_m.z()) < kOnSurface_m) {
        ++num_on_top;
        EXPECT_LT(std::abs(p.x()), options.box_size_m.x() / 2 + kOnSurface_m);
        EXPECT_LT(std::abs(p.y()), options.box_size_m.y() / 2 + kOnSurface_m);
      }
      num_on_plane += std::abs(p.z()) < kOnSurface_m ? 1 : 0;
    }
  }
  // Its top, 12 m by 10 m at 44 m, is about 39 px by 24 px; most of the picture is the plane.
  EXPECT_GT(num_on_top, 700);
  EXPECT_GT(num_on_plane, kRenderCamera.width * kRenderCamera.height / 2);
}

TEST(Render, SkyHasDepthZero) {
  PlaneOptions plane;
  plane.half_extent_m = 5;
  const Rendering rendering =
      Render(BuildPlane(plane), kRenderCamera, LookAt({-50, 0, 10}, {0, 0, 12}));
  EXPECT_EQ(rendering.depth.at<float>(0, 80), 0);
  EXPECT_GT(rendering.bgr.at<cv::Vec3b>(0, 80)[0], 150);
}

TEST(Render, SameSeedSameBytesOnAnyNumberOfThreads) {
  const Pose T_world_cam = LookAt({10, -30, 40}, {0, 0, 0});
  RenderOptions options;
  options.sensor.read_noise = 0.01;
  const Rendering a = Render(BuildPlaneAndBox(), kRenderCamera, T_world_cam, options);
  const int num_threads = cv::getNumThreads();
  cv::setNumThreads(1);
  const Rendering b = Render(BuildPlaneAndBox(), kRenderCamera, T_world_cam, options);
  cv::setNumThreads(num_threads);
  EXPECT_EQ(CountDifferentBytes(a.bgr, b.bgr), 0);
  EXPECT_EQ(cv::countNonZero(a.depth != b.depth), 0);
  options.sensor.seed = 2;
  const Rendering c = Render(BuildPlaneAndBox(), kRenderCamera, T_world_cam, options);
  EXPECT_GT(CountDifferentBytes(a.bgr, c.bgr), 0);
}

TEST(Render, RefusesBadOptions) {
  const Scene scene = BuildPlane();
  RenderOptions options;
  options.samples_per_side = 0;
  EXPECT_THROW(Render(scene, kRenderCamera, Pose(), options), UsageError);
  EXPECT_THROW(Render(scene, kRenderCamera, Shot{}), Error);
}

}  // namespace
}  // namespace mono3d::synthetic
