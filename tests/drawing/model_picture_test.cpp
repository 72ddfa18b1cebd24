// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "drawing/model_picture.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <random>

#include "evaluation/cloud_scenes.h"
#include "mono3d/core/error.h"

namespace mono3d::tools {
namespace {

CameraModel SmallCamera() {
  CameraModel camera;
  camera.width = 41;
  camera.height = 31;
  camera.fx = 40;
  camera.fy = 44;
  camera.cx = 20;
  camera.cy = 15;
  return camera;
}

PointCloud OneDisc(const Eigen::Vector3f& centre, const Eigen::Vector3f& normal, float radius) {
  PointCloud disc;
  disc.points = {centre};
  disc.normals = {normal.normalized()};
  disc.radii = {radius};
  disc.colours = {{10, 20, 30}};
  disc.confidences = {0.25F};
  return disc;
}

void Append(PointCloud& cloud, const PointCloud& disc) {
  cloud.points.push_back(disc.points[0]);
  cloud.normals.push_back(disc.normals[0]);
  cloud.radii.push_back(disc.radii[0]);
  cloud.colours.push_back(disc.colours[0]);
  cloud.confidences.push_back(disc.confidences[0]);
}

TEST(RenderModel, DrawsADiscAsItIs) {
  // 10 su away a pixel is 1/4 su wide: a radius of 2 pixels.
  const ModelRendering seen =
      RenderModel(OneDisc({0, 0, 10}, {0, 0, -1}, 0.51F), SmallCamera(), Pose());
  EXPECT_EQ(seen.bgr.at<cv::Vec3b>(15, 20), cv::Vec3b(30, 20, 10));
  EXPECT_FLOAT_EQ(seen.depth.at<float>(15, 20), 10);
  EXPECT_FLOAT_EQ(seen.depth.at<float>(15, 22), 10);
  EXPECT_EQ(seen.depth.at<float>(15, 23), 0);
  EXPECT_EQ(seen.depth.at<float>(17, 22), 0);  // it is round
  EXPECT_EQ(seen.confidence.at<float>(15, 20), 0.25F);
  EXPECT_EQ(seen.normal.at<cv::Vec3f>(15, 20), cv::Vec3f(0, 0, -1));
  EXPECT_EQ(seen.normal.at<cv::Vec3f>(0, 0), cv::Vec3f(0, 0, 0));
}

TEST(RenderModel, FindsTheDepthOnASlantedDisc) {
  const ModelRendering seen =
      RenderModel(OneDisc({0, 0, 10}, {1, 0, -1}, 3), SmallCamera(), Pose());
  // On z - x = 10 the ray of 4 pixels to the right, x = z / 10, lies at 100 / 9.
  EXPECT_NEAR(seen.depth.at<float>(15, 24), 100 / 9.0, 1e-4);
  EXPECT_NEAR(seen.depth.at<float>(15, 16), 100 / 11.0, 1e-4);
}

TEST(RenderModel, ShowsTheNearerOfTwoFromAnyPose) {
  PointCloud discs = OneDisc({0, 0, 10}, {0, 0, -1}, 1);
  Append(discs, OneDisc({0, 0, 12}, {0, 0, 1}, 2));
  discs.colours[1] = {255, 0, 0};
  const ModelRendering front = RenderModel(discs, SmallCamera(), Pose());
  EXPECT_FLOAT_EQ(front.depth.at<float>(15, 20), 10);
  EXPECT_FLOAT_EQ(front.depth.at<float>(15, 26), 12);
  const Pose behind(Eigen::Quaterniond(0, 0, 1, 0), Eigen::Vector3d(0, 0, 20));
  const ModelRendering back = RenderModel(discs, SmallCamera(), behind);
  EXPECT_FLOAT_EQ(back.depth.at<float>(15, 20), 8);
  EXPECT_EQ(back.bgr.at<cv::Vec3b>(15, 20), cv::Vec3b(0, 0, 255));
}

TEST(RenderModel, KeepsADiscSmallerThanAPixel) {
  const ModelRendering seen =
      RenderModel(OneDisc({0.1F, 0, 10}, {0, 0, -1}, 0.01F), SmallCamera(), Pose());
  EXPECT_EQ(cv::countNonZero(seen.depth), 1);
  EXPECT_FLOAT_EQ(seen.depth.at<float>(15, 20), 10);
}

// The plain reference: every pixel asks every disc.
cv::Mat DepthByRays(const PointCloud& discs, const CameraModel& camera, const Pose& T_world_cam) {
  cv::Mat depth(camera.height, camera.width, CV_32FC1, cv::Scalar(0));
  const Pose T_cam_world = T_world_cam.Inverse();
  for (std::size_t i = 0; i < discs.size(); ++i) {
    const Eigen::Vector3d p = T_cam_world * discs.points[i].cast<double>();
    const Eigen::Vector3d n = T_cam_world.rotation() * discs.normals[i].cast<double>();
    if (p.z() - discs.radii[i] <= 0) continue;
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const Eigen::Vector3d ray = camera.Unproject({x, y});
        double z = n.dot(p) / n.dot(ray);
        const bool is_middle =
            (camera.Project(p) - Eigen::Vector2d(x, y)).cwiseAbs().maxCoeff() < 0.5;
        const bool hit = std::abs(n.dot(ray)) >= 1e-3 * ray.norm() && z > 0 &&
                         (ray * z - p).norm() <= discs.radii[i];
        if (!hit && !is_middle) continue;
        if (is_middle && (!hit || p.z() < z)) z = p.z();
        float& nearest = depth.at<float>(y, x);
        if (nearest == 0 || z < nearest) nearest = static_cast<float>(z);
      }
    }
  }
  return depth;
}

TEST(RenderModel, EqualsReference) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> at(-8, 8);
  std::uniform_real_distribution<float> size(0.05F, 1.5F);
  PointCloud discs;
  for (int i = 0; i < 300; ++i) {
    Append(discs, OneDisc({at(random), at(random), 12 + at(random)},
                          {at(random), at(random), at(random)}, size(random)));
  }
  const Pose pose(RotationExp({0.1, -0.2, 0.3}), Eigen::Vector3d(0.5, -1, -4));
  const cv::Mat found = RenderModel(discs, SmallCamera(), pose).depth;
  const cv::Mat expected = DepthByRays(discs, SmallCamera(), pose);
  EXPECT_GT(cv::countNonZero(expected), 700);
  // Rounding on the rim of a disc.
  EXPECT_LE(cv::countNonZero(cv::abs(found - expected) > 1e-4), 2);
}

TEST(ToPicture, ShowsEachAspect) {
  const ModelRendering seen =
      RenderModel(OneDisc({0, 0, 10}, {0, 0, -1}, 1), SmallCamera(), Pose());
  const cv::Vec3b white(255, 255, 255);
  for (const char* name : {"colour", "normal", "confidence", "depth"}) {
    const cv::Mat picture = ToPicture(seen, ToModelAspect(name));
    EXPECT_EQ(picture.at<cv::Vec3b>(0, 0), white) << name;
    EXPECT_NE(picture.at<cv::Vec3b>(15, 20), white) << name;
  }
  EXPECT_EQ(ToPicture(seen, ModelAspect::kConfidence).at<cv::Vec3b>(15, 20), cv::Vec3b(64, 64, 64));
  EXPECT_EQ(ToPicture(seen, ModelAspect::kNormal).at<cv::Vec3b>(15, 20), cv::Vec3b(0, 128, 128));
  EXPECT_THROW(ToModelAspect("taste"), UsageError);
}

TEST(Recoloured, PaintsTheAspectOntoTheCloud) {
  const PointCloud disc = OneDisc({0, 0, 10}, {0, 0, -1}, 1);
  using Rgb = std::array<std::uint8_t, 3>;
  EXPECT_EQ(Recoloured(disc, ModelAspect::kConfidence).colours[0], (Rgb{64, 64, 64}));
  EXPECT_EQ(Recoloured(disc, ModelAspect::kNormal).colours[0], (Rgb{128, 128, 0}));
  EXPECT_EQ(Recoloured(disc, ModelAspect::kColour).colours[0], (Rgb{10, 20, 30}));
  EXPECT_THROW(Recoloured(disc, ModelAspect::kDepth), UsageError);
}

TEST(RenderModel, RefusesWhatItCannotDraw) {
  PointCloud disc = OneDisc({0, 0, 10}, {0, 0, -1}, 1);
  CameraModel distorted = SmallCamera();
  distorted.distortion[0] = 0.1;
  EXPECT_THROW(RenderModel(disc, distorted, Pose()), Error);
  EXPECT_THROW(RenderModel({}, SmallCamera(), Pose()), Error);
  disc.radii.clear();
  EXPECT_THROW(RenderModel(disc, SmallCamera(), Pose()), Error);
}

}  // namespace
}  // namespace mono3d::tools
