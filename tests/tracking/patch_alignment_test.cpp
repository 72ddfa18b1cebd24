// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/alignment/patch_alignment.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <opencv2/core.hpp>

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
const Eigen::Vector2d kStart(0.4, -0.3);  // off the truth

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

// Just before a camera pixels are beyond what an int holds.
TEST(AlignPatch, RefusesPixelsFarAway) {
  const Octaves waves = BuildOctaves(Waves({0, 0}));
  const auto patch = TakePatch(waves, {70, 58}, 0);
  ASSERT_TRUE(patch.has_value());
  const double two_to_32 = std::ldexp(1.0, 32);
  for (const double far : {1e12, 1e30, two_to_32 + 70}) {
    EXPECT_FALSE(AlignPatch(*patch, kSame, waves, {far, 58}).has_value()) << far;
    EXPECT_FALSE(AlignPatch(*patch, kSame, waves, {70, far}).has_value()) << far;
    EXPECT_FALSE(TakePatch(waves, {far, 58}, 0).has_value()) << far;
  }
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

// Of a plane in camera a: where camera b sees what is at pixel `p` of camera a.
Eigen::Vector2d Transfer(const CameraModel& camera, const Pose& T_b_a, const Eigen::Vector2d& at,
                         double z, const Eigen::Vector2d& normal, const Eigen::Vector2d& p) {
  const double inverse_z = (1 + normal.dot(p - at)) / z;
  return camera.Project(T_b_a * (camera.Unproject(p) / inverse_z));
}

TEST(WarpPatch, IsTheDerivativeOfTheTransferOverThePlane) {
  const CameraModel camera = SmallCamera();
  const Pose T_b_a(RotationExp({0.05, -0.2, 0.3}), {0.5, -0.2, 0.3});
  const Eigen::Vector2d pixel(120, 90);
  const double z = 4;
  const Eigen::Vector2d facing = FacingNormal(camera, pixel);
  for (const Eigen::Vector2d& normal : {facing, Eigen::Vector2d(0.002, -0.001)}) {
    const auto warp = WarpPatch(camera, T_b_a, pixel, z, normal);
    ASSERT_TRUE(warp.has_value());
    const auto transfer = [&](const Eigen::Vector2d& p) {
      return Transfer(camera, T_b_a, pixel, z, normal, p);
    };
    constexpr double kStep = 1e-3;
    for (int axis = 0; axis < 2; ++axis) {
      const Eigen::Vector2d step = kStep * Eigen::Vector2d::Unit(axis);
      const Eigen::Vector2d by_pixel =
          (transfer(pixel + step) - transfer(pixel - step)) / (2 * kStep);
      EXPECT_LT((warp->by_pixel.col(axis) - by_pixel).norm(), 1e-6);
    }
    const Eigen::Vector2d change(1e-3, -2e-3);
    const auto other = WarpPatch(camera, T_b_a, pixel, z, normal + change);
    ASSERT_TRUE(other.has_value());
    EXPECT_LT((other->by_pixel - warp->by_pixel - warp->by_normal * change.transpose()).norm(),
              1e-12);
  }
}

TEST(WarpPatch, HalvesThePatchAtTwiceTheDistance) {
  const CameraModel camera = SmallCamera();
  const Eigen::Vector2d centre(camera.cx, camera.cy);
  const Eigen::Vector2d facing = FacingNormal(camera, centre);
  const auto warp =
      WarpPatch(camera, Pose(Eigen::Quaterniond::Identity(), {0, 0, 4}), centre, 4, facing);
  ASSERT_TRUE(warp.has_value());
  EXPECT_LT((warp->by_pixel - 0.5 * kSame).norm(), 1e-12);
  const Pose behind(Eigen::Quaterniond::Identity(), {0, 0, -5});
  EXPECT_FALSE(WarpPatch(camera, behind, centre, 4, facing).has_value());
}

// A plane that leans by 45 degrees and more, with waves on it, and a camera b that sees it from
// the side.
struct LeaningWaves {
  CameraModel camera = SmallCamera();
  Pose T_b_a{RotationExp({0, -0.15, 0}), {0.6, 0.1, 0}};
  Eigen::Vector2d at{190.3, 110.6};
  double z = 4;
  Eigen::Vector2d normal{0.004, -0.002};
  Octaves in_a;
  Octaves in_b;

  LeaningWaves() {
    const Eigen::Vector2i around = at.cast<int>();
    constexpr int kSide = 40;
    cv::Mat a(camera.height, camera.width, CV_8UC1, cv::Scalar(128));
    cv::Mat b = a.clone();
    for (int row = 0; row < camera.height; ++row) {
      for (int column = 0; column < camera.width; ++column) {
        if (std::abs(row - around.y()) < kSide && std::abs(column - around.x()) < kSide) {
          a.at<std::uint8_t>(row, column) = Grey({column, row});
        }
        b.at<std::uint8_t>(row, column) = Grey(ToA({column, row}));
      }
    }
    in_a = BuildOctaves(a);
    in_b = BuildOctaves(b);
  }

  // Where camera a sees what is at this pixel of camera b.
  Eigen::Vector2d ToA(const Eigen::Vector2d& pixel_b) const {
    const Eigen::Vector3d plane_normal(
        normal.x() * camera.fx, normal.y() * camera.fy,
        1 + normal.x() * (camera.cx - at.x()) +
            normal.y() * (camera.cy - at.y()));  // plane_normal . p = z
    const Pose T_a_b = T_b_a.Inverse();
    const Eigen::Vector3d ray = T_a_b.rotation() * camera.Unproject(pixel_b);
    const double along = (z - plane_normal.dot(T_a_b.translation())) / plane_normal.dot(ray);
    return camera.Project(T_a_b.translation() + along * ray);
  }
  static std::uint8_t Grey(const Eigen::Vector2d& p) {
    return static_cast<std::uint8_t>(std::lround(120 + 40 * std::sin(0.5 * p.x() + 0.2 * p.y()) +
                                                 30 * std::cos(0.3 * p.x() - 0.6 * p.y()) +
                                                 20 * std::sin(0.004 * p.x() * p.y())));
  }
  Eigen::Vector2d InB() const { return Transfer(camera, T_b_a, at, z, normal, at); }
  PatchWarp Warp(const Eigen::Vector2d& with) const {
    return WarpPatch(camera, T_b_a, at, z, with).value();
  }
};

TEST(AlignPatch, IsOffWhereTheSurfaceLeansOtherwise) {
  const LeaningWaves world;
  const auto patch = TakePatch(world.in_a, world.at, 0);
  ASSERT_TRUE(patch.has_value());
  const auto error_with = [&](const Eigen::Vector2d& normal) {
    const auto found =
        AlignPatch(*patch, world.Warp(normal).by_pixel, world.in_b, world.InB() + kStart);
    return found ? (found->pixel - world.InB()).norm() : HUGE_VAL;
  };
  EXPECT_LT(error_with(world.normal), kMaxError_px);
  EXPECT_GT(error_with(FacingNormal(world.camera, world.at)), 2 * kMaxError_px);
}

TEST(MeasureNormal, TellsHowTheSurfaceLeans) {
  const LeaningWaves world;
  auto patch = TakePatch(world.in_a, world.at, 0);
  ASSERT_TRUE(patch.has_value());
  patch->normal = UnknownNormal(world.camera, world.at);
  const double before = (patch->normal.value - world.normal).norm();
  // Linear in what it does not know yet: twice gets there. The place may be off meanwhile.
  for (int i = 0; i < 2; ++i) {
    const auto evidence = MeasureNormal(*patch, world.Warp(patch->normal.value), world.in_b,
                                        world.InB() + Eigen::Vector2d(0.1, -0.1));
    ASSERT_TRUE(evidence.has_value());
    // Across the parallax it hardly tells anything, along it a lot; both are of the normal.
    EXPECT_GT(evidence->information.eigenvalues().real().minCoeff(), 0);
    patch->normal.value = evidence->information.inverse() * evidence->weighted_normal;
  }
  EXPECT_LT((patch->normal.value - world.normal).norm(), 0.1 * before);
}

TEST(MeasureNormal, SaysNothingWithoutParallaxOrTexture) {
  LeaningWaves world;
  auto patch = TakePatch(world.in_a, world.at, 0);
  ASSERT_TRUE(patch.has_value());
  patch->normal = UnknownNormal(world.camera, world.at);
  const double prior = patch->normal.information.norm();
  world.T_b_a = Pose();
  const auto still = MeasureNormal(*patch, world.Warp(patch->normal.value), world.in_a, world.at);
  ASSERT_TRUE(still.has_value());
  EXPECT_LT(still->information.norm(), 1e-9 * prior);
  const Octaves grey = BuildOctaves(cv::Mat(224, 384, CV_8UC1, cv::Scalar(90)));
  EXPECT_FALSE(MeasureNormal(*patch, world.Warp(patch->normal.value), grey, world.at).has_value());
  EXPECT_FALSE(
      MeasureNormal(*patch, world.Warp(patch->normal.value), world.in_a, {2, 100}).has_value());
}

TEST(AlignPatch, KnowsHowSureItIs) {
  const Eigen::Vector2d at(70.3, 58.6);
  const cv::Mat picture = Waves({0, 0});
  const auto patch = TakePatch(BuildOctaves(picture), at, 0);
  ASSERT_TRUE(patch.has_value());
  cv::RNG random(SeedFromTestName());
  for (const double noise : {4.0, 12.0}) {
    constexpr int kNumTries = 400;
    double sum_error2 = 0;
    double sum_sigma2 = 0;
    for (int i = 0; i < kNumTries; ++i) {
      cv::Mat change(picture.size(), CV_32FC1);
      random.fill(change, cv::RNG::NORMAL, 0, noise);
      cv::Mat noisy;
      cv::add(picture, change, noisy, cv::noArray(), CV_8U);
      const auto found = AlignPatch(*patch, kSame, BuildOctaves(noisy), at);
      ASSERT_TRUE(found.has_value());
      sum_error2 += (found->pixel - at).squaredNorm() / 2;
      sum_sigma2 += found->sigma_px * found->sigma_px;
    }
    // How much of the noise interpolation takes depends on the place.
    const double ratio = std::sqrt(sum_error2 / sum_sigma2);
    EXPECT_GT(ratio, 0.75) << noise;
    EXPECT_LT(ratio, 1.35) << noise;
  }
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
