// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "fusion/fusion_scene.h"

namespace mono3d {
namespace {

Eigen::Vector3f Normal(const std::array<float, 4>& candidate) {
  return {candidate[0], candidate[1], candidate[2]};
}

TEST(Prepare, FitsTheNormalOfAPlane) {
  // Sums of 49 floats of four digits less than they carry.
  constexpr float kMaxError = 1e-3F;
  const Plane plane{Eigen::Vector3d(0.3, -0.4, -1).normalized(), -9};
  const Pose pose = MovedPose();
  StageScene scene(PlaneMap(TestCamera(33, 17), pose, plane), {});
  scene.RunPrepare();
  const Eigen::Vector3f expected = (pose.rotation().inverse() * plane.normal).cast<float>();
  for (const auto& candidate : scene.DeviceCandidates()) {
    EXPECT_LT((Normal(candidate) - expected).norm(), kMaxError);
    EXPECT_EQ(candidate[3], 1);
  }
}

TEST(Prepare, DoesNotSmoothAcrossADepthStep) {
  constexpr float kMaxError = 1e-3F;
  CameraModel camera = TestCamera(32, 16);
  camera.fx = camera.fy = 700;  // pixels so fine that no surface is as steep as the step
  TrackedMap map = PlaneMap(camera, Pose(), Plane{{0, 0, -1}, -20});
  const TrackedMap near = PlaneMap(camera, Pose(), Plane{{0, 0, -1}, -5});
  near.depth.colRange(0, 16).copyTo(map.depth.colRange(0, 16));
  StageScene scene(map, {});
  scene.RunPrepare();
  for (const auto& candidate : scene.DeviceCandidates()) {
    EXPECT_LT((Normal(candidate) - Eigen::Vector3f(0, 0, -1)).norm(), kMaxError);
  }
}

TEST(Prepare, KeepsTheNormalsOfTheMap) {
  TrackedMap map = PlaneMap(TestCamera(9, 5), Pose());
  map.normal = cv::Mat(5, 9, CV_32FC3, cv::Scalar(0, 0.6, -0.8));
  map.normal.at<cv::Vec3f>(2, 4) = cv::Vec3f(0, 0, 0);  // this one is to be fitted
  StageScene scene(map, {});
  scene.RunPrepare();
  const auto candidates = scene.DeviceCandidates();
  EXPECT_NEAR(candidates[0][1], 0.6, 1e-6);
  EXPECT_NEAR(candidates[0][2], -0.8, 1e-6);
  EXPECT_NEAR(candidates[2 * 9 + 4][1], 0, 1e-3);
}

TEST(Prepare, LeavesPixelsWithoutEstimateEmpty) {
  TrackedMap map = PlaneMap(TestCamera(4, 1), Pose());
  map.confidence = cv::Mat(1, 4, CV_32FC1, cv::Scalar(0.5));
  map.depth.at<float>(0, 0) = 0;
  map.confidence.at<float>(0, 1) = 0;
  map.depth.at<float>(0, 2) = std::numeric_limits<float>::quiet_NaN();
  StageScene scene(map, {});
  EXPECT_EQ(scene.packed.blocks.num_candidates, 1);
  scene.RunPrepare();
  const auto candidates = scene.DeviceCandidates();
  for (const std::size_t i : {0U, 1U, 2U}) {
    EXPECT_EQ(candidates[i], (std::array<float, 4>{0, 0, 0, 0}));
  }
  // Alone there is no plane to fit: the surfel faces the camera.
  const Eigen::Vector3f towards = -Eigen::Vector3f(1.5F / 4, 0, 1).normalized();
  EXPECT_LT((Normal(candidates[3]) - towards).norm(), 1e-5F);
  EXPECT_EQ(candidates[3][3], 0.5F);
}

TEST(Prepare, EqualsReference) {
  // A sample at the border of the window's reach may be in for one and out for the other, which
  // moves one normal; the rest differ by rounding.
  constexpr double kMaxDifferingShare = 0.002;
  constexpr float kMaxError = 2e-3F;
  for (const auto& [width, height] : {std::pair{1, 1}, {17, 33}, {96, 56}}) {
    StageScene scene(width, height, 1);
    scene.RunPrepare();
    const auto expected = reference::Prepare(scene.view, scene.packed);
    const auto found = scene.DeviceCandidates();
    ASSERT_EQ(found.size(), expected.size());
    std::size_t different = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_EQ(found[i][3], expected[i][3]);
      different += (Normal(found[i]) - Normal(expected[i])).norm() > kMaxError ? 1 : 0;
    }
    EXPECT_LE(static_cast<double>(different),
              kMaxDifferingShare * static_cast<double>(found.size()));
  }
}

// As packing a map that has no other estimates.
TEST(PackInferred, WritesThoseOfTheMapAndTakesAwayTheLastOnes) {
  TrackedMap map = PlaneMap(TestCamera(70, 5), Pose());
  map.normal = cv::Mat(5, 70, CV_32FC3, cv::Scalar(0, 0.6, -0.8));
  map.normal.at<cv::Vec3f>(2, 40) = cv::Vec3f(0, 0, 0);
  map.confidence = cv::Mat(5, 70, CV_32FC1, cv::Scalar(0.5));
  const auto num_pixels = static_cast<std::size_t>(5 * 70);
  PackedDepthMap packed{std::vector<float>(num_pixels),
                        std::vector<std::array<float, 4>>(num_pixels),
                        std::vector<std::uint32_t>(num_pixels),
                        {}};
  const std::vector<std::uint32_t> colours(num_pixels, 0x112233);
  std::vector<std::uint32_t> pixels;
  for (const cv::Rect part : {cv::Rect(30, 1, 20, 3), cv::Rect(0, 3, 70, 2)}) {
    map.inferred = cv::Mat::zeros(map.depth.size(), CV_8UC1);
    map.inferred(part) = 255;
    packed.blocks = PackInferred(map, true, colours,
                                 {packed.depth, packed.normal_confidence, packed.colour}, pixels);
    TrackedMap only = map;
    only.depth = cv::Mat(map.depth.size(), CV_32FC1, cv::Scalar(0));
    map.depth.copyTo(only.depth, map.inferred);
    const PackedDepthMap expected = Pack(only);
    EXPECT_EQ(packed.depth, expected.depth);
    EXPECT_EQ(packed.normal_confidence, expected.normal_confidence);
    EXPECT_EQ(packed.blocks.num_candidates, part.area());
    EXPECT_EQ(packed.blocks.with_candidates, expected.blocks.with_candidates);
    EXPECT_EQ(packed.blocks.to_fit, expected.blocks.to_fit);
    for (const std::uint32_t pixel : pixels) EXPECT_EQ(packed.colour[pixel], 0x112233U);
  }
}

}  // namespace
}  // namespace mono3d
