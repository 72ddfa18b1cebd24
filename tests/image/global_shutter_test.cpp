// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/image/global_shutter.h"

#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <string>

#include "mono3d/core/error.h"
#include "mono3d/image/undistorter.h"
#include "synthetic/flight.h"
#include "synthetic/render.h"
#include "synthetic/test_scenes.h"

namespace mono3d {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr double kReadoutTime_s = 0.03;

struct ShutterCase {
  const char* name;
  CameraVelocity velocity;
  bool has_distortion = false;
  bool reads_columns = false;
  bool is_reversed = false;
};

// In a world that is 20 to 50 away, some pixels from the first line to the last.
const Eigen::Vector3d kTurn(-0.4, 0.7, 0.3);
const Eigen::Vector3d kWay(20, 12, -15);
const ShutterCase kShutterCases[] = {
    {"rotation", {kTurn, {0, 0, 0}}},
    {"translation", {{0, 0, 0}, kWay}},
    {"both", {kTurn, kWay}},
    {"lens", {kTurn, kWay}, true},
    {"columns", {kTurn, kWay}, true, true},
    {"reversed", {kTurn, kWay}, false, false, true},
    {"reversed columns", {kTurn, kWay}, true, true, true},
};

CameraModel SensorOf(const ShutterCase& c) {
  CameraModel sensor{
      .width = 256, .height = 160, .fx = 230, .fy = 230, .cx = 127.5, .cy = 79.5, .distortion = {}};
  if (c.has_distortion) sensor.distortion = {-0.2, 0.06, 0.002, -0.001, 0};
  sensor.shutter = {c.is_reversed ? -kReadoutTime_s : kReadoutTime_s, c.reads_columns};
  return sensor;
}

// A keyframe without an image.
Keyframe MakeKeyframe(const ShutterCase& c) {
  Keyframe keyframe;
  keyframe.velocity = c.velocity;
  keyframe.frame.name = c.name;
  keyframe.frame.sensor = SensorOf(c);
  keyframe.frame.camera = Undistorter(keyframe.frame.sensor).camera();
  return keyframe;
}

ShutterMotion MotionOf(const Keyframe& keyframe) {
  return {keyframe.frame.sensor, keyframe.velocity};
}

// z-depth by pixel.
using DepthFunction = std::function<double(const Eigen::Vector2d& pixel)>;

// That of a plane 30 away, which leans by so much.
DepthFunction LeaningPlane(const CameraModel& camera, const Eigen::Vector2d& lean) {
  return [=](const Eigen::Vector2d& pixel) {
    return 30 / (1 + lean.dot(camera.Unproject(pixel).head<2>()));
  };
}

Eigen::Vector3d PointAt(const CameraModel& camera, const Eigen::Vector2d& pixel,
                        const DepthFunction& depth) {
  return depth(pixel) * camera.Unproject(pixel);
}

// Sparse points all over the image, where the rolling shutter shows them.
void AddPoints(const DepthFunction& depth, int num_points, Keyframe& keyframe) {
  const CameraModel& camera = keyframe.frame.camera;
  const ShutterMotion motion = MotionOf(keyframe);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> x(0, camera.width - 1);
  std::uniform_real_distribution<double> y(0, camera.height - 1);
  for (int i = 0; i < num_points; ++i) {
    const Eigen::Vector2d pixel(x(random), y(random));
    const double z = depth({std::round(pixel.x()), std::round(pixel.y())});
    if (z <= 0) continue;
    const Eigen::Vector3d p_cam = z * camera.Unproject(pixel);
    keyframe.sparse_depths_su.push_back(static_cast<float>(z));
    keyframe.sparse_pixels.emplace_back(motion.Project(camera, p_cam).cast<float>());
  }
}

// Waves along x or y, as cosine and sine, so that their phase tells a position to a hundredth of a
// pixel.
constexpr double kWave_px = 24;
cv::Mat Waves(const CameraModel& camera, bool along_y) {
  cv::Mat bgr(camera.height, camera.width, CV_8UC3);
  for (int y = 0; y < bgr.rows; ++y) {
    for (int x = 0; x < bgr.cols; ++x) {
      const double phase = 2 * std::numbers::pi * (along_y ? y : x) / kWave_px;
      bgr.at<cv::Vec3b>(y, x) = {cv::saturate_cast<std::uint8_t>(127.5 + 120 * std::cos(phase)),
                                 cv::saturate_cast<std::uint8_t>(127.5 + 120 * std::sin(phase)), 0};
    }
  }
  return bgr;
}

// By how much `place` differs from that which a pixel of the waves shows.
double PhaseError_px(const cv::Vec3b& bgr, double place) {
  const double phase = std::atan2(bgr[1] - 127.5, bgr[0] - 127.5);
  const double waves = place / kWave_px - phase / (2 * std::numbers::pi);
  return (waves - std::round(waves)) * kWave_px;
}

struct PlaceErrors {
  double largest_px = 0;
  double longest_way_px = 0;  // that the shutter has moved the scene
};

// Where each pixel of the image that comes out was taken from, against where the rolling shutter
// shows what is `depth` away.
PlaceErrors ErrorsOfPlaces(Keyframe keyframe, const DepthFunction& depth) {
  PlaceErrors errors;
  const CameraModel camera = keyframe.frame.camera;
  const ShutterMotion motion = MotionOf(keyframe);
  for (const bool along_y : {false, true}) {
    keyframe.frame.bgr = Waves(camera, along_y);
    const cv::Mat moved = WithGlobalShutter(keyframe).frame.bgr;
    for (int y = 0; y < moved.rows; ++y) {
      for (int x = 0; x < moved.cols; ++x) {
        const Eigen::Vector2d pixel(x, y);
        const Eigen::Vector2d source = motion.Project(camera, PointAt(camera, pixel, depth));
        if (!camera.Contains(source)) continue;
        const double error =
            PhaseError_px(moved.at<cv::Vec3b>(y, x), along_y ? source.y() : source.x());
        errors.largest_px = std::max(errors.largest_px, std::abs(error));
        errors.longest_way_px = std::max(errors.longest_way_px, (source - pixel).norm());
      }
    }
  }
  return errors;
}

// Rounding of grey levels and of cv::remap's positions, to 1/32 px, make 0.055 of it.
constexpr double kMaxError_px = 0.07;

TEST(GlobalShutter, LeavesAnImageThatHasOneAlone) {
  Keyframe keyframe = MakeKeyframe(kShutterCases[2]);
  AddPoints(LeaningPlane(keyframe.frame.camera, {0, 0}), 10, keyframe);
  keyframe.frame.bgr = Waves(keyframe.frame.camera, false);
  const auto expect_same = [&](const char* what) {
    const Keyframe same = WithGlobalShutter(keyframe);
    EXPECT_EQ(same.frame.bgr.data, keyframe.frame.bgr.data) << what;
    EXPECT_EQ(same.sparse_pixels, keyframe.sparse_pixels) << what;
    EXPECT_EQ(same.frame.sensor, CameraModel()) << what;
  };
  const CameraModel sensor = keyframe.frame.sensor;
  keyframe.frame.sensor.shutter = {};
  expect_same("global shutter");
  keyframe.frame.sensor = {};
  expect_same("no sensor");
  keyframe.frame.sensor = sensor;
  EXPECT_NE(WithGlobalShutter(keyframe).frame.bgr.data, keyframe.frame.bgr.data);
  keyframe.velocity = {};
  expect_same("camera that stands still");
}

TEST(GlobalShutter, DoesNotChangeTheKeyframeThatItIsGiven) {
  Keyframe keyframe = MakeKeyframe(kShutterCases[2]);
  keyframe.frame.bgr = Waves(keyframe.frame.camera, false);
  const cv::Mat before = keyframe.frame.bgr.clone();
  (void)WithGlobalShutter(keyframe);
  EXPECT_EQ(cv::norm(keyframe.frame.bgr, before, cv::NORM_INF), 0);
}

TEST(GlobalShutter, BringsEveryPixelOfAPlaneToItsPlace) {
  for (const ShutterCase& c : kShutterCases) {
    Keyframe keyframe = MakeKeyframe(c);
    const DepthFunction depth = LeaningPlane(keyframe.frame.camera, {0.3, -0.8});
    AddPoints(depth, 100, keyframe);
    const PlaceErrors errors = ErrorsOfPlaces(keyframe, depth);
    EXPECT_GT(errors.longest_way_px, 2) << c.name;
    EXPECT_LT(errors.largest_px, kMaxError_px) << c.name;
  }
}

TEST(GlobalShutter, MovesTheSparsePixelsWithTheImage) {
  for (const ShutterCase& c : kShutterCases) {
    Keyframe keyframe = MakeKeyframe(c);
    const CameraModel& camera = keyframe.frame.camera;
    const ShutterMotion motion = MotionOf(keyframe);
    std::vector<Eigen::Vector3d> points;
    for (const double x : {-10, 0, 9}) points.emplace_back(x, 0.6 * x, 30 + x);
    for (const Eigen::Vector3d& p_cam : points) {
      keyframe.sparse_depths_su.push_back(static_cast<float>(p_cam.z()));
      keyframe.sparse_pixels.emplace_back(motion.Project(camera, p_cam).cast<float>());
    }
    keyframe.frame.bgr = Waves(camera, false);
    const Keyframe moved = WithGlobalShutter(keyframe);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector2d expected = camera.Project(points[i]);
      EXPECT_LT((moved.sparse_pixels[i].cast<double>() - expected).norm(), 0.01) << c.name;
    }
    EXPECT_EQ(moved.sparse_depths_su, keyframe.sparse_depths_su);
  }
}

TEST(GlobalShutter, DoesWithoutPointsWhereTheCameraOnlyTurns) {
  Keyframe keyframe = MakeKeyframe(kShutterCases[0]);
  const DepthFunction depth = LeaningPlane(keyframe.frame.camera, {0.3, -0.8});
  EXPECT_LT(ErrorsOfPlaces(keyframe, depth).largest_px, kMaxError_px);
}

// Without their pixels the depths tell one distance; one point does as well.
TEST(GlobalShutter, TakesWhatFewPointsTell) {
  Keyframe keyframe = MakeKeyframe(kShutterCases[2]);
  const CameraModel& camera = keyframe.frame.camera;
  const DepthFunction depth = LeaningPlane(camera, {0, 0});
  const double without_points_px = ErrorsOfPlaces(keyframe, depth).largest_px;
  EXPECT_GT(without_points_px, 1);
  keyframe.sparse_depths_su = {29, 30, 31, 1e6F, std::nanf(""), -1};
  EXPECT_LT(ErrorsOfPlaces(keyframe, depth).largest_px, 0.1 * without_points_px);
  for (const int num_points : {1, 2, 3}) {
    keyframe.sparse_depths_su.clear();
    keyframe.sparse_pixels.clear();
    AddPoints(depth, num_points, keyframe);
    EXPECT_LT(ErrorsOfPlaces(keyframe, depth).largest_px, kMaxError_px) << num_points;
  }
}

TEST(GlobalShutter, IsNotMisledByAFewWrongPoints) {
  Keyframe keyframe = MakeKeyframe(kShutterCases[2]);
  const DepthFunction depth = LeaningPlane(keyframe.frame.camera, {0.3, -0.8});
  AddPoints(depth, 300, keyframe);
  for (std::size_t i = 0; i < keyframe.sparse_depths_su.size(); i += 10) {
    keyframe.sparse_depths_su[i] *= i % 20 == 0 ? 0.1F : 20;
  }
  EXPECT_LT(ErrorsOfPlaces(keyframe, depth).largest_px, 2 * kMaxError_px);
}

TEST(GlobalShutter, RefusesPixelsThatAreNotThoseOfTheDepths) {
  Keyframe keyframe = MakeKeyframe(kShutterCases[2]);
  keyframe.sparse_depths_su = {1, 2, 3};
  keyframe.sparse_pixels = {{1, 1}};
  EXPECT_THAT([&] { (void)WithGlobalShutter(keyframe); },
              ThrowsMessage<Error>(HasSubstr("both: wrong number of sparse pixels (expected one "
                                             "for each of 3 depths, found 1)")));
}

// What the renderer shows of a plane with a box through a rolling shutter.
struct RenderedKeyframe {
  Keyframe keyframe;
  cv::Mat global_bgr;  // through a global shutter
};

RenderedKeyframe RenderCase(const ShutterCase& c) {
  static const synthetic::Scene scene = synthetic::BuildPlaneAndBox();
  RenderedKeyframe rendered;
  rendered.keyframe = MakeKeyframe(c);
  CameraModel lens = rendered.keyframe.frame.sensor;
  lens.shutter = {};
  const Undistorter undistorter(lens);
  const Pose T_world_cam = synthetic::LookAt({6, -25, 32}, {0, 0, 2});
  const auto motion = [&](double t_s) {
    const Pose T_later_cam(RotationExp(t_s * c.velocity.angular_rad_per_s),
                           t_s * c.velocity.linear_su_per_s);
    return T_world_cam * T_later_cam.Inverse();
  };
  synthetic::RenderOptions options;
  const synthetic::Rendering truth = Render(scene, lens, {motion, 0, 0}, options);
  rendered.global_bgr = undistorter.Undistort(truth.bgr);
  options.sensor.readout_s = kReadoutTime_s;
  options.sensor.readout_direction =
      c.reads_columns ? (c.is_reversed ? "left" : "right") : (c.is_reversed ? "up" : "down");
  rendered.keyframe.frame.bgr =
      undistorter.Undistort(Render(scene, lens, {motion, 0, 0}, options).bgr);
  const auto depth = [&](const Eigen::Vector2d& pixel) -> double {
    return truth.depth.at<float>(static_cast<int>(pixel.y()), static_cast<int>(pixel.x()));
  };
  AddPoints(depth, 400, rendered.keyframe);
  return rendered;
}

// Mean of the absolute differences, in grey levels, away from the border, behind which there is no
// image, and in what depth estimation sees: little of the finest detail.
double GreyDifference(const cv::Mat& a, const cv::Mat& b) {
  constexpr int kBorder_px = 10;
  const cv::Rect inner(kBorder_px, kBorder_px, a.cols - 2 * kBorder_px, a.rows - 2 * kBorder_px);
  const auto smooth = [](const cv::Mat& bgr) {
    cv::Mat grey;
    ToGrey(bgr).convertTo(grey, CV_32F);
    cv::GaussianBlur(grey, grey, {}, 2);
    return grey;
  };
  cv::Mat difference;
  cv::absdiff(smooth(a)(inner), smooth(b)(inner), difference);
  return cv::mean(difference)[0];
}

TEST(GlobalShutter, MakesTheImageOfACameraThatHasOne) {
  for (const ShutterCase& c : kShutterCases) {
    const RenderedKeyframe rendered = RenderCase(c);
    const double before = GreyDifference(rendered.keyframe.frame.bgr, rendered.global_bgr);
    const double after =
        GreyDifference(WithGlobalShutter(rendered.keyframe).frame.bgr, rendered.global_bgr);
    EXPECT_GT(before, 2) << c.name;
    // Sampling the image twice and the edges of the box leave 0.3 to 0.4.
    EXPECT_LT(after, 0.2 * before) << c.name;
  }
}

}  // namespace
}  // namespace mono3d
