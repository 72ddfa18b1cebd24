// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/true_cloud.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "mono3d/core/error.h"
#include "synthetic/flight.h"
#include "synthetic/test_scenes.h"

namespace mono3d::synthetic {
namespace {

const CameraModel kCloudCamera{96, 56, 86.4, 86.4, 47.5, 27.5};
constexpr double kVoxel_m = 1.0;
// Single precision at 100 m.
constexpr float kCloudRounding_m = 1e-4F;

const cv::Mat kRedImage(kCloudCamera.height, kCloudCamera.width, CV_8UC3, cv::Scalar(0, 0, 255));

Pose From(double x, double y) { return LookAt({x, y, 60}, {0, 0, 0}); }

TEST(TrueCloud, PointsOfAPlaneLieOnItWithItsNormalAndTheImagesColour) {
  const Scene scene = BuildPlane();
  TrueCloud cloud(kVoxel_m, 300);
  cloud.Add(scene, kCloudCamera, From(40, 30), kRedImage);
  const PointCloud points = cloud.Build();
  ASSERT_GT(points.size(), 500U);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_NEAR(points.points[i].z(), 0, kCloudRounding_m);
    EXPECT_NEAR(points.normals[i].z(), 1, 1e-5);
    EXPECT_EQ(points.colours[i], (std::array<std::uint8_t, 3>{255, 0, 0}));
    EXPECT_EQ(points.observations[i], 1U);
  }
}

TEST(TrueCloud, HasOnePointInEachCell) {
  const Scene scene = BuildPlaneAndBox();
  TrueCloud cloud(kVoxel_m, 300);
  for (int i = 0; i < 4; ++i) cloud.Add(scene, kCloudCamera, From(40 - 5 * i, 30), kRedImage);
  std::set<std::array<int, 3>> cells;
  const PointCloud points = cloud.Build();
  for (const Eigen::Vector3f& p : points.points) {
    cells.insert({static_cast<int>(std::floor(p.x())), static_cast<int>(std::floor(p.y())),
                  static_cast<int>(std::floor(p.z()))});
  }
  EXPECT_EQ(cells.size(), points.size());
  EXPECT_EQ(*std::max_element(points.observations.begin(), points.observations.end()), 4U);
}

// Distance from the surface of the box of 12 x 10 x 8 m on the plane z = 0.
float DistanceFromSurface(const Eigen::Vector3f& p) {
  const Eigen::Vector3f to_faces(std::abs(std::abs(p.x()) - 6), std::abs(std::abs(p.y()) - 5),
                                 std::abs(p.z() - 8));
  return std::min(to_faces.minCoeff(), std::abs(p.z()));
}

TEST(TrueCloud, LiesOnTheBoxAndReachesItsRoof) {
  const Scene scene = BuildPlaneAndBox();
  TrueCloud cloud(kVoxel_m, 300);
  cloud.Add(scene, kCloudCamera, From(40, 30), kRedImage);
  float highest = 0;
  const PointCloud points = cloud.Build();
  for (const Eigen::Vector3f& p : points.points) {
    EXPECT_LT(DistanceFromSurface(p), kCloudRounding_m);
    highest = std::max(highest, p.z());
  }
  EXPECT_NEAR(highest, 8, kCloudRounding_m);
}

TEST(TrueCloud, TheOrderOfTheImagesDoesNotMatter) {
  const Scene scene = BuildPlaneAndBox();
  TrueCloud forth(kVoxel_m, 300);
  TrueCloud back(kVoxel_m, 300);
  const std::array<Pose, 3> poses = {From(40, 30), From(20, 40), From(-30, 35)};
  for (const Pose& pose : poses) forth.Add(scene, kCloudCamera, pose, kRedImage);
  for (auto pose = poses.rbegin(); pose != poses.rend(); ++pose) {
    back.Add(scene, kCloudCamera, *pose, kRedImage);
  }
  const PointCloud a = forth.Build();
  const PointCloud b = back.Build();
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.normals, b.normals);
  EXPECT_EQ(a.observations, b.observations);
}

TEST(TrueCloud, EndsAtTheLargestDepth) {
  const Scene scene = BuildPlane();
  TrueCloud cloud(kVoxel_m, 70);
  const Pose T_world_cam = From(40, 30);
  cloud.Add(scene, kCloudCamera, T_world_cam, kRedImage);
  const PointCloud points = cloud.Build();
  ASSERT_FALSE(points.empty());
  for (const Eigen::Vector3f& p : points.points) {
    EXPECT_LT((T_world_cam.Inverse() * p.cast<double>()).z(), 70 + kCloudRounding_m);
  }
}

TEST(TrueCloud, RefusesBadInput) {
  const Scene scene = BuildPlane();
  EXPECT_THROW(TrueCloud(0, 300), Error);
  EXPECT_THROW(TrueCloud(1, -1), Error);
  TrueCloud cloud(kVoxel_m, 300);
  EXPECT_THROW(cloud.Add(scene, kCloudCamera, From(40, 30), kRedImage.colRange(0, 50)), Error);
  CameraModel distorted = kCloudCamera;
  distorted.distortion[0] = 0.1;
  EXPECT_THROW(cloud.Add(scene, distorted, From(40, 30), kRedImage), Error);
}

}  // namespace
}  // namespace mono3d::synthetic
