// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/stored_depth_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <random>

#include "fusion/fusion_scene.h"

namespace mono3d {
namespace {

DepthMap FullMap() {
  TrackedMap map = PlaneMap(TestCamera(48, 32), MovedPose());
  Disturb(map, 0.5, 7, 1);
  map.normal = cv::Mat::zeros(map.depth.size(), CV_32FC3);
  map.confidence = cv::Mat::zeros(map.depth.size(), CV_32FC1);
  std::mt19937 random(2);
  std::uniform_real_distribution<float> component(-1, 1);
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      if (map.depth.at<float>(y, x) <= 0) continue;
      const cv::Vec3f n(component(random), component(random), -std::abs(component(random)));
      map.normal.at<cv::Vec3f>(y, x) = cv::normalize(n);
      map.confidence.at<float>(y, x) = std::abs(component(random));
    }
  }
  map.keyframe_id = 12;
  map.views = {{7, MovedPose()}};
  map.patch_noise = 1.7;
  return map;
}

TEST(StoredDepthMap, LosesLessThanNoise) {
  const DepthMap map = FullMap();
  const StoredDepthMap stored(map);
  const DepthMap found = stored.Restore();
  EXPECT_EQ(found.keyframe_id, 12);
  ASSERT_EQ(found.views.size(), 1U);
  EXPECT_EQ(found.views[0].keyframe_id, 7);
  EXPECT_EQ(found.patch_noise, 1.7);
  EXPECT_EQ(cv::norm(found.bgr, map.bgr), 0);
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      const float z = map.depth.at<float>(y, x);
      if (z <= 0) {
        EXPECT_EQ(found.depth.at<float>(y, x), 0);
        EXPECT_EQ(cv::norm(found.normal.at<cv::Vec3f>(y, x)), 0);
        continue;
      }
      EXPECT_NEAR(found.depth.at<float>(y, x) / z, 1, 1e-4);
      EXPECT_GT(found.normal.at<cv::Vec3f>(y, x).dot(map.normal.at<cv::Vec3f>(y, x)),
                std::cos(0.025));
      EXPECT_NEAR(found.confidence.at<float>(y, x), map.confidence.at<float>(y, x),
                  0.5 / 255 + 1e-6);
    }
  }
  // 3 bytes of colour, and 5 in place of 20.
  EXPECT_EQ(stored.num_bytes(), map.depth.total() * 8);
}

TEST(StoredDepthMap, HoldsAMapWithoutEstimates) {
  TrackedMap map = PlaneMap(TestCamera(5, 3), Pose());
  map.depth.setTo(0);
  const DepthMap found = StoredDepthMap(map).Restore();
  EXPECT_EQ(cv::countNonZero(found.depth), 0);
  EXPECT_TRUE(found.normal.empty());
}

}  // namespace
}  // namespace mono3d
