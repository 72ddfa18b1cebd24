// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/village.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "mono3d/core/error.h"
#include "synthetic/rendered_sequence.h"

namespace mono3d::synthetic {
namespace {

// Two frames of an orbit, three steps apart. Even sizes of which OpenCV has a fast Fourier
// transform: others it pads, and then its phase correlation is off by half a pixel.
const RenderedSequence& TwoFrames() {
  static const RenderedSequence sequence = [] {
    OrbitOptions orbit;
    orbit.num_frames = 4;
    orbit.start_deg = 215;
    const std::vector<Pose> flight = OrbitFlight(orbit);
    const CameraModel camera{384, 216, 345.6, 345.6, 191.5, 107.5};
    return RenderSequence(BuildVillage(), camera, {flight.front(), flight.back()});
  }();
  return sequence;
}

// The image of frame `from` as frame `to` should show it, by depth and poses; `is_seen` marks the
// pixels of `to` that both see.
struct Warp {
  cv::Mat grey;     // CV_32FC1
  cv::Mat is_seen;  // CV_8UC1
};

Warp WarpInto(const RenderedSequence& sequence, std::size_t from, std::size_t to) {
  const CameraModel& camera = sequence.frames[to].camera;
  const Pose T_from_to = sequence.T_world_cam[from].Inverse() * sequence.T_world_cam[to];
  cv::Mat map(camera.height, camera.width, CV_32FC2, cv::Scalar(-9, -9));
  Warp warp;
  warp.is_seen = cv::Mat::zeros(camera.height, camera.width, CV_8UC1);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const double depth_m = sequence.depth[to].at<float>(y, x);
      if (depth_m <= 0) continue;
      const Eigen::Vector3d p_from =
          T_from_to * Eigen::Vector3d(depth_m * camera.Unproject(Eigen::Vector2d(x, y)));
      const Eigen::Vector2d pixel = camera.Project(p_from);
      if (!camera.Contains(pixel, 1)) continue;
      map.at<cv::Vec2f>(y, x) = {static_cast<float>(pixel.x()), static_cast<float>(pixel.y())};
      const float seen_m = sequence.depth[from].at<float>(static_cast<int>(std::lround(pixel.y())),
                                                          static_cast<int>(std::lround(pixel.x())));
      constexpr double kSameSurface = 0.01;  // of the depth: less than a storey at 80 m
      if (std::abs(seen_m - p_from.z()) < kSameSurface * p_from.z())
        warp.is_seen.at<uchar>(y, x) = 1;
    }
  }
  cv::Mat grey;
  ToGrey(sequence.frames[from].bgr).convertTo(grey, CV_32F);
  cv::remap(grey, warp.grey, map, cv::noArray(), cv::INTER_CUBIC);
  return warp;
}

cv::Mat GreyOf(const Frame& frame) {
  cv::Mat grey;
  ToGrey(frame.bgr).convertTo(grey, CV_32F);
  return grey;
}

TEST(BuildVillage, WarpedImageAgreesWithTheOther) {
  const RenderedSequence& sequence = TwoFrames();
  constexpr std::size_t kFrom = 0;
  constexpr std::size_t kTo = 1;
  const Warp warp = WarpInto(sequence, kFrom, kTo);
  const cv::Mat grey = GreyOf(sequence.frames[kTo]);
  EXPECT_GT(cv::mean(warp.is_seen)[0], 0.7);
  cv::Mat difference;
  cv::absdiff(grey, warp.grey, difference);
  cv::Scalar mean;
  cv::Scalar deviation;
  cv::meanStdDev(grey, mean, deviation, warp.is_seen);
  // Interpolation blurs the finest texture; without the warp the difference is about the deviation.
  constexpr double kShareOfContrast = 0.3;
  EXPECT_LT(cv::mean(difference, warp.is_seen)[0], kShareOfContrast * deviation[0]);
}

TEST(BuildVillage, WarpedImageIsNotShifted) {
  const RenderedSequence& sequence = TwoFrames();
  constexpr std::size_t kTo = 1;
  const Warp warp = WarpInto(sequence, 0, kTo);
  cv::Mat mask;
  warp.is_seen.convertTo(mask, CV_32F);
  const cv::Mat seen = warp.grey.mul(mask);
  const cv::Mat shown = GreyOf(sequence.frames[kTo]).mul(mask);
  cv::Mat window;
  cv::createHanningWindow(window, seen.size(), CV_32F);
  const cv::Point2d shift = cv::phaseCorrelate(seen, shown, window);
  constexpr double kShift_px = 0.08;  // what phase correlation tells apart on sharp edges
  EXPECT_LT(std::hypot(shift.x, shift.y), kShift_px);
}

TEST(BuildVillage, SameSeedSameScene) {
  VillageOptions options;
  options.half_extent_m = 60;
  options.num_trees = 5;
  options.num_bushes = 5;
  const Scene a = BuildVillage(options);
  const Scene b = BuildVillage(options);
  EXPECT_EQ(a.mesh().vertices, b.mesh().vertices);
  EXPECT_EQ(a.mesh().triangles, b.mesh().triangles);
  options.seed = 2;
  EXPECT_NE(a.mesh().vertices, BuildVillage(options).mesh().vertices);
}

TEST(BuildVillage, TextureIsEverywhere) {
  // Each block of 32 x 32 px has contrast: nothing in the picture is flat.
  const cv::Mat grey = GreyOf(TwoFrames().frames[0]);
  constexpr int kBlock_px = 32;
  constexpr double kContrast = 4;  // grey levels, well above the rounding to 8 bits
  for (int y = 0; y + kBlock_px <= grey.rows; y += kBlock_px) {
    for (int x = 0; x + kBlock_px <= grey.cols; x += kBlock_px) {
      cv::Scalar mean;
      cv::Scalar deviation;
      cv::meanStdDev(grey(cv::Rect(x, y, kBlock_px, kBlock_px)), mean, deviation);
      EXPECT_GT(deviation[0], kContrast) << x << " " << y;
    }
  }
}

TEST(BuildVillage, RefusesBadOptions) {
  VillageOptions options;
  options.half_extent_m = 0;
  EXPECT_THROW(BuildVillage(options), UsageError);
}

}  // namespace
}  // namespace mono3d::synthetic
