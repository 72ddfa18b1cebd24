// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/geometry/distortion.h"
#include "mono3d/image/undistorter.h"
#include "synthetic/flight.h"
#include "synthetic/lens.h"
#include "synthetic/render.h"
#include "synthetic/test_scenes.h"

namespace mono3d::synthetic {
namespace {

const CameraModel kEffectsCamera{256, 160, 230, 230, 127.5, 79.5};

CameraModel Distorted() {
  CameraModel camera = kEffectsCamera;
  camera.distortion = {-0.25, 0.08, 0.002, -0.001, 0.01};
  return camera;
}

const Scene& BoxScene() {
  static const Scene scene = BuildPlaneAndBox();
  return scene;
}

CameraModel Fisheye() {
  CameraModel camera = kEffectsCamera;
  camera.fx = camera.fy = 100;  // 147 degrees across the width
  camera.distortion = {0.03, -0.01, 0.002, 0, 0};
  camera.lens = LensModel::kFisheye;
  return camera;
}

// Over the box, with a speed of 20 m/s across and a yaw of 0.5 rad/s.
Shot MovingShot() {
  const Pose T_world_cam = LookAt({6, -30, 40}, {0, 0, 2});
  const auto motion = [=](double t_s) {
    return T_world_cam * Pose(RotationExp({0, 0.5 * t_s, 0}), Eigen::Vector3d(20 * t_s, 0, 0));
  };
  return {motion, 1.0, 0};
}

cv::Mat Grey(const cv::Mat& radiance) {
  cv::Mat grey;
  cv::cvtColor(radiance, grey, cv::COLOR_BGR2GRAY);
  return grey;
}

// The shift (px) that brings `a` closest to `b` where the mask (CV_8U) is set, to first order, by
// least squares (Lucas and Kanade 1981), and what is left then as a share of the contrast.
struct Agreement {
  Eigen::Vector2d shift_px;
  double residual = 0;
};
Agreement Compare(const cv::Mat& a, const cv::Mat& b, const cv::Mat& mask) {
  cv::Mat smooth_a;
  cv::Mat smooth_b;
  cv::GaussianBlur(a, smooth_a, {}, 1.5);
  cv::GaussianBlur(b, smooth_b, {}, 1.5);
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  double difference = 0;
  double num = 0;
  for (int y = 2; y < a.rows - 2; ++y) {
    for (int x = 2; x < a.cols - 2; ++x) {
      if (mask.at<std::uint8_t>(y, x) == 0) continue;
      const Eigen::Vector2d gradient(
          (smooth_a.at<float>(y, x + 1) - smooth_a.at<float>(y, x - 1)) / 2,
          (smooth_a.at<float>(y + 1, x) - smooth_a.at<float>(y - 1, x)) / 2);
      const double error = smooth_b.at<float>(y, x) - smooth_a.at<float>(y, x);
      normal += gradient * gradient.transpose();
      right += gradient * error;
      difference += error * error;
      num += 1;
    }
  }
  cv::Scalar mean;
  cv::Scalar sigma;
  cv::meanStdDev(a, mean, sigma, mask);
  return {normal.ldlt().solve(right), std::sqrt(difference / num) / sigma[0]};
}

struct View {
  cv::Mat grey;
  cv::Mat depth;
  Pose T_world_cam;
};

View ViewFrom(const Eigen::Vector3d& eye, const CameraModel& camera) {
  View view;
  view.T_world_cam = LookAt(eye, {0, 0, 2});
  const Rendering rendering = Render(BoxScene(), camera, view.T_world_cam);
  cv::Mat grey;
  cv::cvtColor(Undistorter(camera).Undistort(rendering.bgr), grey, cv::COLOR_BGR2GRAY);
  grey.convertTo(view.grey, CV_32F);
  view.depth = rendering.depth;
  return view;
}

// `source` as seen from `target`, by the target's depth; the mask leaves out what the source does
// not see.
struct Warped {
  cv::Mat grey;
  cv::Mat mask;
};
Warped WarpToTarget(const View& source, const View& target, const CameraModel& camera) {
  const Pose T_source_target = source.T_world_cam.Inverse() * target.T_world_cam;
  cv::Mat map(target.depth.size(), CV_32FC2, cv::Scalar::all(-1));
  cv::Mat mask = cv::Mat::zeros(target.depth.size(), CV_8UC1);
  for (int y = 0; y < map.rows; ++y) {
    for (int x = 0; x < map.cols; ++x) {
      const double depth_m = target.depth.at<float>(y, x);
      const Eigen::Vector3d p_source =
          T_source_target * Eigen::Vector3d(depth_m * camera.Unproject(Eigen::Vector2d(x, y)));
      const Eigen::Vector2d pixel = camera.Project(p_source);
      map.at<cv::Vec2f>(y, x) = {static_cast<float>(pixel.x()), static_cast<float>(pixel.y())};
      if (!camera.Contains(pixel, 3)) continue;
      const double seen_m = source.depth.at<float>(static_cast<int>(std::lround(pixel.y())),
                                                   static_cast<int>(std::lround(pixel.x())));
      constexpr double kSameDepth = 0.03;  // a pixel of the slanting plane is 1 % of the depth deep
      if (std::abs(seen_m / p_source.z() - 1) < kSameDepth) mask.at<std::uint8_t>(y, x) = 255;
    }
  }
  Warped warped;
  cv::remap(source.grey, warped.grey, map, cv::noArray(), cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  // Blurred differences reach over the edge of what is seen.
  cv::erode(mask, warped.mask, cv::Mat(), {-1, -1}, 3);
  return warped;
}

// What depth and tracking would not notice.
constexpr double kMaxShift_px = 0.02;
// Left over by different footprints and interpolation, as a share of the contrast.
constexpr double kMaxResidual = 0.06;

TEST(Render, PictureWarpedByDepthAndPosesAgreesWithTheOther) {
  for (const CameraModel& distorted : {kEffectsCamera, Distorted()}) {
    const CameraModel camera = DepthCamera(distorted);
    const View source = ViewFrom({0, -30, 42}, distorted);
    const View target = ViewFrom({4, -29, 41}, distorted);
    const Warped warped = WarpToTarget(source, target, camera);
    EXPECT_GT(cv::countNonZero(warped.mask), 0.6 * camera.width * camera.height);
    const Agreement all = Compare(warped.grey, target.grey, warped.mask);
    EXPECT_LT(all.shift_px.norm(), kMaxShift_px);
    EXPECT_LT(all.residual, kMaxResidual);
    // At the edges of the box alone.
    cv::Mat near_edge;
    cv::morphologyEx(target.depth, near_edge, cv::MORPH_GRADIENT,
                     cv::getStructuringElement(cv::MORPH_RECT, {13, 13}));
    const cv::Mat edge_mask = (near_edge > 4) & warped.mask;  // metres
    EXPECT_GT(cv::countNonZero(edge_mask), 300);
    const Agreement edge = Compare(warped.grey, target.grey, edge_mask);
    EXPECT_LT(edge.shift_px.norm(), 3 * kMaxShift_px);  // a twentieth of the pixels
  }
}

TEST(Render, UndistortedPictureOfALensIsThatOfTheDepthCamera) {
  for (const CameraModel& distorted : {Distorted(), Fisheye()}) {
    const CameraModel camera = DepthCamera(distorted);
    EXPECT_FALSE(camera.HasDistortion());
    const View lens = ViewFrom({6, -30, 40}, distorted);
    const View ideal = ViewFrom({6, -30, 40}, camera);
    EXPECT_EQ(cv::norm(lens.depth, ideal.depth, cv::NORM_INF), 0);
    const cv::Mat everywhere(lens.grey.size(), CV_8UC1, cv::Scalar(255));
    const Agreement agreement = Compare(lens.grey, ideal.grey, everywhere);
    EXPECT_LT(agreement.shift_px.norm(), kMaxShift_px);
    // A fisheye lens shows less detail towards the border than a pinhole camera, which stretches
    // it: as sharp as that one it is in the middle alone.
    cv::Mat sharp = everywhere.clone();
    if (distorted.lens == LensModel::kFisheye) {
      sharp.setTo(0);
      sharp(cv::Rect(camera.width / 4, camera.height / 4, camera.width / 2, camera.height / 2)) =
          255;
    }
    EXPECT_LT(Compare(lens.grey, ideal.grey, sharp).residual, kMaxResidual);
    // That the lens does something: the pictures differ before.
    const cv::Mat raw = Grey(RenderRadiance(BoxScene(), distorted, MovingShot()));
    const cv::Mat pinhole =
        Grey(RenderRadiance(BoxScene(), distorted.WithoutDistortion(), MovingShot()));
    EXPECT_GT(Compare(raw, pinhole, everywhere).residual, 2 * kMaxResidual);
  }
}

// Lines of sight go round to the back; each is what the lens shows at its pixel.
TEST(Lens, OfAFisheyeLooksBeyondARightAngle) {
  CameraModel camera = Fisheye();
  camera.fx = camera.fy = 60;
  const Lens lens(camera);
  EXPECT_LT(lens.Direction(0, 0, {0, 0}).z(), -0.5);
  for (const Eigen::Vector2f& shift : {Eigen::Vector2f(0, 0), Eigen::Vector2f(0.5, -0.5)}) {
    for (const Eigen::Vector2i& pixel :
         {Eigen::Vector2i(0, 0), {127, 79}, {128, 80}, {200, 30}, {255, 159}}) {
      const Eigen::Vector3d ray = lens.Direction(pixel.x(), pixel.y(), shift).cast<double>();
      const Eigen::Vector2d expected = pixel.cast<double>() + shift.cast<double>();
      // Half a pixel on along the tangent: 0.5^2 / 60 px.
      EXPECT_LT((ProjectDistorted(camera, ray) - expected).norm(), 0.01);
    }
  }
}

TEST(RollingShutter, OfACameraThatStandsStillChangesNothing) {
  RenderOptions options;
  const Pose T_world_cam = LookAt({6, -30, 40}, {0, 0, 2});
  const cv::Mat still = Render(BoxScene(), kEffectsCamera, T_world_cam, options).bgr;
  options.sensor.readout_s = 0.03;
  const cv::Mat rolling = Render(BoxScene(), kEffectsCamera, T_world_cam, options).bgr;
  EXPECT_EQ(cv::norm(still, rolling, cv::NORM_INF), 0);
}

TEST(RollingShutter, EachRowIsThatOfThePoseAtItsTime) {
  RenderOptions options;
  options.sensor.readout_s = 0.04;
  const Shot shot = MovingShot();
  const cv::Mat rolling = RenderRadiance(BoxScene(), kEffectsCamera, shot, options);
  options.sensor.readout_s = 0;
  for (const int y : {0, 53, 159}) {
    const Shot at_row{shot.motion, shot.t_s + 0.04 * (y / 159.0 - 0.5), 0};
    const cv::Mat sharp = RenderRadiance(BoxScene(), kEffectsCamera, at_row, options);
    EXPECT_LT(cv::norm(rolling.row(y), sharp.row(y), cv::NORM_INF), 1e-6);
    const cv::Mat other = RenderRadiance(BoxScene(), kEffectsCamera, shot, options);
    EXPECT_GT(cv::norm(rolling.row(y), other.row(y), cv::NORM_INF), 0.01);
  }
}

// Each line is that of the pose at its time, whichever way the sensor is read.
TEST(RollingShutter, ReadsItsLinesInTheDirectionAskedFor) {
  const Shot shot = MovingShot();
  constexpr double kReadout_s = 0.04;
  const auto at_part = [&](double part) {
    const Shot at_line{shot.motion, shot.t_s + kReadout_s * (part - 0.5), 0};
    return RenderRadiance(BoxScene(), kEffectsCamera, at_line);
  };
  const cv::Mat first = at_part(0);
  const cv::Mat last = at_part(1);
  const int right = kEffectsCamera.width - 1;
  const int bottom = kEffectsCamera.height - 1;
  const auto top_row = [](const cv::Mat& image) { return image.row(0); };
  const auto bottom_row = [&](const cv::Mat& image) { return image.row(bottom); };
  const auto left_column = [](const cv::Mat& image) { return image.col(0); };
  const auto right_column = [&](const cv::Mat& image) { return image.col(right); };
  using Line = std::function<cv::Mat(const cv::Mat&)>;
  struct Case {
    const char* direction;
    Line read_first;
    Line read_last;
  };
  const std::vector<Case> cases = {{"down", top_row, bottom_row},
                                   {"up", bottom_row, top_row},
                                   {"right", left_column, right_column},
                                   {"left", right_column, left_column}};
  for (const Case& c : cases) {
    RenderOptions options;
    options.sensor.readout_s = kReadout_s;
    options.sensor.readout_direction = c.direction;
    const cv::Mat rolling = RenderRadiance(BoxScene(), kEffectsCamera, shot, options);
    EXPECT_LT(cv::norm(c.read_first(rolling), c.read_first(first), cv::NORM_INF), 1e-6);
    EXPECT_LT(cv::norm(c.read_last(rolling), c.read_last(last), cv::NORM_INF), 1e-6);
    EXPECT_GT(cv::norm(c.read_first(rolling), c.read_first(last), cv::NORM_INF), 0.01);
    EXPECT_GT(cv::norm(c.read_last(rolling), c.read_last(first), cv::NORM_INF), 0.01);
  }
}

TEST(LineDelay, IsFromALineToTheNextDownOrToTheRight) {
  SensorOptions options;
  EXPECT_EQ(LineDelay_s(options, 640, 361), 0);
  options.readout_s = 0.036;
  EXPECT_NEAR(LineDelay_s(options, 641, 361), 1e-4, 1e-12);
  options.readout_direction = "up";
  EXPECT_NEAR(LineDelay_s(options, 641, 361), -1e-4, 1e-12);
  options.readout_direction = "left";
  EXPECT_NEAR(LineDelay_s(options, 601, 361), -6e-5, 1e-12);
}

TEST(Render, TellsTheExposureOfThePicture) {
  RenderOptions options;
  options.sensor.exposure = 0.5;
  options.with_depth = false;
  const Rendering dark = Render(BoxScene(), kEffectsCamera, MovingShot(), options);
  EXPECT_DOUBLE_EQ(dark.exposure, 0.5);
  options.sensor.auto_exposure = 1;
  const Rendering metered = Render(BoxScene(), kEffectsCamera, MovingShot(), options);
  const cv::Scalar mean = cv::mean(RenderRadiance(BoxScene(), kEffectsCamera, MovingShot()));
  EXPECT_NEAR(metered.exposure, 0.5 * 0.18 / ((mean[0] + mean[1] + mean[2]) / 3), 1e-9);
}

TEST(MotionBlur, IsTheMeanOfSharpPictures) {
  RenderOptions options;
  const Shot shot = MovingShot();
  constexpr double kExposure_s = 0.03;  // 6 px of blur
  constexpr int kNumSharp = 24;
  cv::Mat mean = cv::Mat::zeros(kEffectsCamera.height, kEffectsCamera.width, CV_32FC3);
  for (int i = 0; i < kNumSharp; ++i) {
    const double t_s = shot.t_s + kExposure_s * ((i + 0.5) / kNumSharp - 0.5);
    mean += RenderRadiance(BoxScene(), kEffectsCamera, {shot.motion, t_s, 0}, options) / kNumSharp;
  }
  const cv::Mat sharp = RenderRadiance(BoxScene(), kEffectsCamera, shot, options);
  options.sensor.exposure_s = kExposure_s;
  const cv::Mat blurred = RenderRadiance(BoxScene(), kEffectsCamera, shot, options);
  const double error = cv::norm(blurred, mean, cv::NORM_L2);
  const double blur = cv::norm(sharp, mean, cv::NORM_L2);
  // 16 rays a pixel against 96: what is left is the grain of fine texture.
  EXPECT_LT(error, 0.15 * blur);
  const cv::Mat everywhere(mean.size(), CV_8UC1, cv::Scalar(255));
  EXPECT_LT(Compare(Grey(blurred), Grey(mean), everywhere).shift_px.norm(), kMaxShift_px);
}

TEST(ShutterSpan, ReachesFromTheFirstRowsOpeningToTheLastRowsClosing) {
  SensorOptions options;
  options.readout_s = 0.02;
  options.exposure_s = 0.01;
  EXPECT_NEAR(ShutterSpan(options, 3).begin_s, 2.985, 1e-12);
  EXPECT_NEAR(ShutterSpan(options, 3).end_s, 3.015, 1e-12);
}

TEST(Render, RefusesADistortionThatFoldsBack) {
  CameraModel camera = kEffectsCamera;
  camera.distortion[0] = -3;
  EXPECT_THROW(Render(BoxScene(), camera, Pose()), Error);
}

}  // namespace
}  // namespace mono3d::synthetic
