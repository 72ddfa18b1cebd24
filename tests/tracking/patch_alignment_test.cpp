// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/patch_alignment.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

// A smooth picture known between the pixels too, moved by `shift`.
cv::Mat Waves(const Eigen::Vector2d& shift, double contrast = 1, double brightness = 0) {
  cv::Mat picture(120, 160, CV_8UC1);
  for (int row = 0; row < picture.rows; ++row) {
    for (int column = 0; column < picture.cols; ++column) {
      const double x = column - shift.x();
      const double y = row - shift.y();
      const double grey = 110 + 40 * std::sin(0.5 * x + 0.2 * y) +
                          30 * std::cos(0.3 * x - 0.6 * y) + 20 * std::sin(0.11 * x * y / 30);
      picture.at<std::uint8_t>(row, column) =
          static_cast<std::uint8_t>(std::lround(contrast * grey + brightness));
    }
  }
  return picture;
}

const Eigen::Matrix2d kSame = Eigen::Matrix2d::Identity();
// Rounding to whole grey values moves a patch of 81 px by a hundredth; bilinear interpolation of
// waves of 10 px by some more.
constexpr double kMaxError_px = 0.04;

TEST(AlignPatch, FindsAShiftToAFractionOfAPixel) {
  const Eigen::Vector2d at(70.3, 58.6);
  const auto patch = TakePatch(BuildOctaves(Waves({0, 0})), at, 0);
  ASSERT_TRUE(patch.has_value());
  for (const Eigen::Vector2d& shift :
       {Eigen::Vector2d(0, 0), Eigen::Vector2d(0.5, -0.25), Eigen::Vector2d(-1.7, 1.4)}) {
    const auto found = AlignPatch(*patch, kSame, BuildOctaves(Waves(shift)), at);
    ASSERT_TRUE(found.has_value());
    EXPECT_LT((found->pixel - at - shift).norm(), kMaxError_px);
    EXPECT_GT(found->correlation, 0.99);
    EXPECT_EQ(found->octave, 0);
  }
}

TEST(AlignPatch, IsIndifferentToContrastAndBrightness) {
  const Eigen::Vector2d at(70, 58);
  const auto patch = TakePatch(BuildOctaves(Waves({0, 0})), at, 0);
  const auto found = AlignPatch(*patch, kSame, BuildOctaves(Waves({0.6, 0.3}, 0.6, 50)), at);
  ASSERT_TRUE(found.has_value());
  EXPECT_LT((found->pixel - at - Eigen::Vector2d(0.6, 0.3)).norm(), 2 * kMaxError_px);
}

TEST(AlignPatch, FollowsAWarp) {
  const cv::Mat picture = TexturedPicture(160, 120, SeedFromTestName());
  // Half the size: what was at p is at p / 2, which octave 1 shows by definition.
  const Octaves octaves = BuildOctaves(picture);
  const Octaves smaller = BuildOctaves(octaves[1]);
  int num_found = 0;
  for (int x = 60; x <= 100; x += 10) {
    const Eigen::Vector2d at(x, 60);
    const auto patch = TakePatch(octaves, at, 1);
    ASSERT_TRUE(patch.has_value());
    const auto found =
        AlignPatch(*patch, 0.5 * kSame, smaller, 0.5 * at + Eigen::Vector2d(0.6, -0.4));
    if (!found) continue;
    ++num_found;
    EXPECT_LT((found->pixel - 0.5 * at).norm(), kMaxError_px);
    EXPECT_EQ(found->octave, 0);
  }
  EXPECT_GE(num_found, 3);
}

TEST(AlignPatch, RefusesWhatCannotBeFound) {
  const Eigen::Vector2d at(70, 58);
  const Octaves waves = BuildOctaves(Waves({0, 0}));
  const auto patch = TakePatch(waves, at, 0);
  ASSERT_TRUE(patch.has_value());
  // Too far, nothing there, outside the image, turned inside out.
  EXPECT_FALSE(AlignPatch(*patch, kSame, waves, at + Eigen::Vector2d(2.5, 0), 1).has_value());
  const Octaves grey = BuildOctaves(cv::Mat(120, 160, CV_8UC1, cv::Scalar(90)));
  EXPECT_FALSE(AlignPatch(*patch, kSame, grey, at).has_value());
  EXPECT_FALSE(AlignPatch(*patch, kSame, waves, {2, 58}).has_value());
  EXPECT_FALSE(AlignPatch(*patch, -kSame.colwise().reverse(), waves, at).has_value());
  EXPECT_FALSE(AlignPatch(*patch, 3 * kSame, waves, at).has_value() &&
               AlignPatch(*patch, 0.2 * kSame, waves, at).has_value());
}

TEST(AlignPatch, RefusesAPatchWithoutTextureInSomeDirection) {
  cv::Mat edge(120, 160, CV_8UC1, cv::Scalar(50));
  edge.colRange(80, 160).setTo(150);
  const Octaves octaves = BuildOctaves(edge);
  const auto patch = TakePatch(octaves, {80, 60}, 0);
  ASSERT_TRUE(patch.has_value());
  EXPECT_FALSE(AlignPatch(*patch, kSame, octaves, {80, 60}).has_value());
}

TEST(TakePatch, CopiesTheSquareAroundThePoint) {
  const cv::Mat picture = TexturedPicture(160, 120, SeedFromTestName());
  const Octaves octaves = BuildOctaves(picture);
  const auto patch = TakePatch(octaves, {50.25, 40.75}, 0);
  ASSERT_TRUE(patch.has_value());
  EXPECT_EQ(patch->grey[0], picture.at<std::uint8_t>(41 - Patch::kRadius, 50 - Patch::kRadius));
  EXPECT_NEAR(patch->centre.x(), Patch::kRadius + 0.25, 1e-6);
  EXPECT_NEAR(patch->centre.y(), Patch::kRadius - 0.25, 1e-6);
  EXPECT_FALSE(TakePatch(octaves, {9, 40}, 0).has_value());
  EXPECT_FALSE(TakePatch(octaves, {50, 112}, 0).has_value());
  EXPECT_FALSE(TakePatch(octaves, {50, 40}, kNumOctaves).has_value());
}

TEST(PatchWarp, IsTheDerivativeOfTheTransferOverThePlane) {
  const CameraModel camera = SmallCamera();
  const Pose T_b_a(RotationExp({0.05, -0.2, 0.3}), {0.5, -0.2, 0.3});
  const Eigen::Vector2d pixel(120, 90);
  const double z = 4;
  const auto warp = PatchWarp(camera, T_b_a, pixel, z);
  ASSERT_TRUE(warp.has_value());
  const Eigen::Vector3d ray = camera.Unproject(pixel);
  const auto transfer = [&](const Eigen::Vector2d& p) {
    const Eigen::Vector3d other = camera.Unproject(p);
    return camera.Project(T_b_a * (other * (z * ray.squaredNorm() / ray.dot(other))));
  };
  constexpr double kStep = 1e-3;
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d step = kStep * Eigen::Vector2d::Unit(axis);
    const Eigen::Vector2d slope = (transfer(pixel + step) - transfer(pixel - step)) / (2 * kStep);
    EXPECT_LT((warp->col(axis) - slope).norm(), 1e-6);
  }
}

TEST(PatchWarp, HalvesThePatchAtTwiceTheDistance) {
  const CameraModel camera = SmallCamera();
  const Eigen::Vector2d centre(camera.cx, camera.cy);
  const auto warp = PatchWarp(camera, Pose(Eigen::Quaterniond::Identity(), {0, 0, 4}), centre, 4);
  ASSERT_TRUE(warp.has_value());
  EXPECT_LT((*warp - 0.5 * kSame).norm(), 1e-12);
  const Pose behind(Eigen::Quaterniond::Identity(), {0, 0, -5});
  EXPECT_FALSE(PatchWarp(camera, behind, centre, 4).has_value());
}

TEST(BuildOctaves, HalvesAboutTheFirstPixel) {
  const Octaves octaves = BuildOctaves(Waves({0, 0}));
  ASSERT_EQ(octaves.size(), 3U);  // the fourth would be smaller than 24 px
  EXPECT_EQ(octaves[1].cols, 80);
  // A single bright pixel at (40, 60) stays the brightest at (20, 30).
  cv::Mat dot(120, 160, CV_8UC1, cv::Scalar(0));
  dot.at<std::uint8_t>(60, 40) = 255;
  const cv::Mat half = BuildOctaves(dot)[1];
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      if (dx == 0 && dy == 0) continue;
      EXPECT_LT(half.at<std::uint8_t>(30 + dy, 20 + dx), half.at<std::uint8_t>(30, 20));
    }
  }
  EXPECT_EQ(half.at<std::uint8_t>(30, 19), half.at<std::uint8_t>(30, 21));
  EXPECT_EQ(BuildOctaves(cv::Mat(1, 1, CV_8UC1, cv::Scalar(3))).size(), 1U);
}

}  // namespace
}  // namespace mono3d::tracking
