// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/evaluation/normal_error.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <vector>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

constexpr double kNormalFloat = 1e-4;  // normals from depths that are stored as float
const CameraModel kCamera = {.width = 40, .height = 30, .fx = 50, .fy = 55, .cx = 19, .cy = 14.5};

// The plane through (0, 0, depth) with this normal.
cv::Mat PlaneDepth(const Eigen::Vector3d& normal, double depth) {
  cv::Mat image(kCamera.height, kCamera.width, CV_32FC1);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      image.at<float>(y, x) =
          static_cast<float>(normal.z() * depth / normal.dot(kCamera.Unproject({x, y})));
    }
  }
  return image;
}

bool HasNormal(const cv::Mat& normals, int x, int y) {
  return cv::norm(normals.at<cv::Vec3f>(y, x)) > 0;
}

TEST(NormalsFromDepth, AreThoseOfAPlaneWhateverTheScale) {
  const Eigen::Vector3d normal = Eigen::Vector3d(0.5, -0.4, -1).normalized();
  for (const double depth : {0.01, 1.0, 1000.0}) {
    const cv::Mat normals = NormalsFromDepth(PlaneDepth(normal, depth), kCamera);
    for (const auto& [x, y] : {std::pair(2, 2), std::pair(20, 15), std::pair(37, 27)}) {
      const auto n = normals.at<cv::Vec3f>(y, x);
      EXPECT_NEAR(n[0], normal.x(), kNormalFloat) << depth;
      EXPECT_NEAR(n[1], normal.y(), kNormalFloat) << depth;
      EXPECT_NEAR(n[2], normal.z(), kNormalFloat) << depth;
    }
    EXPECT_FALSE(HasNormal(normals, 1, 15));
  }
}

TEST(NormalsFromDepth, AreMissingAtDepthEdgesAndHoles) {
  cv::Mat depth = PlaneDepth({0, 0, -1}, 10);
  depth.colRange(20, 40) = 12.0F;
  depth.at<float>(15, 8) = 0;
  const cv::Mat normals = NormalsFromDepth(depth, kCamera);
  EXPECT_TRUE(HasNormal(normals, 17, 10));   // 15 to 19
  EXPECT_FALSE(HasNormal(normals, 18, 10));  // reaches over the edge
  EXPECT_FALSE(HasNormal(normals, 21, 10));
  EXPECT_TRUE(HasNormal(normals, 22, 10));
  EXPECT_FALSE(HasNormal(normals, 10, 17));  // the hole is in the corner of the window
  EXPECT_TRUE(HasNormal(normals, 11, 17));
}

TEST(NormalsFromDepth, AreMissingWhereTheSurfaceIsRough) {
  cv::Mat depth = PlaneDepth({0, 0, -1}, 10);
  // The footprint of a pixel is 10 / 50 = 0.2: half of it is the bound.
  depth.at<float>(15, 10) += 0.08F;
  depth.at<float>(15, 30) += 0.15F;
  const cv::Mat normals = NormalsFromDepth(depth, kCamera);
  EXPECT_TRUE(HasNormal(normals, 10, 15));
  EXPECT_FALSE(HasNormal(normals, 30, 15));
}

cv::Mat Normals(const std::vector<cv::Vec3f>& normals) {
  return cv::Mat(normals, true).reshape(3, 1);
}

// Turned out of the view direction.
cv::Vec3f Tilted(double angle_deg) {
  const double angle_rad = angle_deg * std::numbers::pi / 180;
  return {static_cast<float>(std::sin(angle_rad)), 0, static_cast<float>(-std::cos(angle_rad))};
}

TEST(SlantedSurfaces, AreThoseTurnedAwayFromTheRay) {
  // The ray of the middle column is the axis; to the right it meets the plane at a smaller angle.
  const double angle = 50 * std::numbers::pi / 180;
  cv::Mat normals(kCamera.height, kCamera.width, CV_32FC3);
  normals = cv::Scalar(-std::sin(angle), 0, -std::cos(angle));
  normals.at<cv::Vec3f>(15, 19) = {0, 0, 0};
  const cv::Mat slanted = SlantedSurfaces(normals, kCamera, 40);
  EXPECT_EQ(slanted.at<uchar>(14, 19), 255);  // 50 degrees
  EXPECT_EQ(slanted.at<uchar>(15, 19), 0);    // no normal
  EXPECT_EQ(slanted.at<uchar>(14, 0), 255);   // 50 + atan(19 / 50) = 70.8 degrees
  EXPECT_EQ(slanted.at<uchar>(14, 39), 0);    // 50 - atan(20 / 50) = 28.2 degrees
  EXPECT_THROW((void)SlantedSurfaces(normals, kCamera, 91), Error);
  EXPECT_THROW((void)SlantedSurfaces(normals.colRange(0, 20), kCamera, 40), Error);
}

TEST(NormalError, IsTheAngleWorkedOutByHand) {
  const cv::Vec3f none(0, 0, 0);
  const cv::Mat truth =
      Normals({Tilted(0), Tilted(0), Tilted(10), Tilted(0), Tilted(0), Tilted(0), none});
  const cv::Mat estimate =
      Normals({Tilted(0), Tilted(20), Tilted(-2), Tilted(25), 2 * Tilted(40), none, Tilted(0)});
  const NormalError error = CompareNormals(estimate, truth);
  EXPECT_EQ(error.num_true_pixels, 6);
  EXPECT_EQ(error.num_pixels, 5);
  EXPECT_NEAR(error.density, 5.0 / 6, kNormalFloat);
  EXPECT_NEAR(error.angle_deg.mean, (0 + 20 + 12 + 25 + 40) / 5.0, kNormalFloat);
  EXPECT_NEAR(error.angle_deg.median, 20, kNormalFloat);
  EXPECT_DOUBLE_EQ(error.share_below_11_25_deg, 0.2);
  EXPECT_DOUBLE_EQ(error.share_below_22_5_deg, 0.6);
  EXPECT_DOUBLE_EQ(error.share_below_30_deg, 0.8);
}

TEST(NormalError, OfManyMapsIsTheMeanOverThem) {
  const NormalError a =
      CompareNormals(Normals({Tilted(10), Tilted(10)}), Normals({Tilted(0), {0, 0, 0}}));
  const NormalError b = CompareNormals(Normals({Tilted(30)}), Normals({Tilted(0)}));
  const NormalError nothing = CompareNormals(Normals({{0, 0, 0}}), Normals({Tilted(0)}));
  const NormalError mean = MeanNormalError(std::vector<NormalError>{a, b, nothing});
  EXPECT_EQ(mean.num_pixels, 2);
  EXPECT_NEAR(mean.angle_deg.mean, 20, kNormalFloat);
  EXPECT_NEAR(mean.angle_deg.min, 10, kNormalFloat);
  EXPECT_NEAR(mean.angle_deg.max, 30, kNormalFloat);
  EXPECT_NEAR(mean.density, 2.0 / 3, kNormalFloat);
  EXPECT_EQ(MeanNormalError({}).num_pixels, 0);
}

TEST(NormalError, RefusesOtherSizesAndTypes) {
  EXPECT_THROW(CompareNormals(Normals({Tilted(0)}), Normals({Tilted(0), Tilted(1)})), Error);
  EXPECT_THROW(NormalsFromDepth(cv::Mat(2, 2, CV_32FC1, cv::Scalar(1)), kCamera), Error);
  EXPECT_THROW(NormalsFromDepth(PlaneDepth({0, 0, -1}, 1), kCamera, {.radius_px = 0}), Error);
}

}  // namespace
}  // namespace mono3d
