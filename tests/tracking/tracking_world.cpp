// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/tracking_world.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "mono3d/geometry/distortion.h"
#include "tracking/features/feature_grid.h"

namespace mono3d::tracking {
namespace {

constexpr int kTextureSize = 1024;
constexpr double kTexelsPerUnit = 24;

// Texture by bilinear interpolation, repeated at its borders.
double Sample(const cv::Mat& texture, double u, double v) {
  const double x = u * kTexelsPerUnit;
  const double y = v * kTexelsPerUnit;
  const auto x0 = static_cast<int>(std::floor(x));
  const auto y0 = static_cast<int>(std::floor(y));
  const double wx = x - x0;
  const double wy = y - y0;
  const auto at = [&](int column, int row) -> double {
    const int mask = kTextureSize - 1;
    return texture.at<std::uint8_t>(row & mask, column & mask);
  };
  return (1 - wy) * ((1 - wx) * at(x0, y0) + wx * at(x0 + 1, y0)) +
         wy * ((1 - wx) * at(x0, y0 + 1) + wx * at(x0 + 1, y0 + 1));
}

}  // namespace

CameraModel SmallCamera() {
  return {.width = 384, .height = 224, .fx = 345.6, .fy = 345.6, .cx = 191.5, .cy = 111.5};
}

cv::Mat TexturedPicture(int width, int height, unsigned seed) {
  std::mt19937 random(seed);
  cv::Mat sum(height, width, CV_32FC1, cv::Scalar(128));
  for (int cell = 2; cell <= 64; cell *= 2) {
    cv::Mat noise(height / cell + 2, width / cell + 2, CV_32FC1);
    for (int y = 0; y < noise.rows; ++y) {
      for (int x = 0; x < noise.cols; ++x) {
        noise.at<float>(y, x) = static_cast<float>(Uniform(random, -40, 40));
      }
    }
    cv::Mat layer;
    cv::resize(noise, layer, cv::Size(width, height), 0, 0, cv::INTER_CUBIC);
    sum += layer;
  }
  cv::Mat picture;
  sum.convertTo(picture, CV_8UC1);
  return picture;
}

Pose LookAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target) {
  const Eigen::Vector3d forward = (target - eye).normalized();
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d R_world_cam;
  R_world_cam << right, forward.cross(right), forward;
  return {R_world_cam, eye};
}

TexturedGround::TexturedGround(bool with_houses)
    : texture_(TexturedPicture(kTextureSize, kTextureSize, 7)) {
  if (!with_houses) return;
  std::mt19937 random(11);
  for (int x = -6; x < 24; x += 3) {
    for (int y = 2; y < 20; y += 3) {
      const Eigen::Vector3d low(x + Uniform(random, 0, 1), y + Uniform(random, 0, 1), 0);
      boxes_.push_back({low, low + Eigen::Vector3d(1.5, 1.2, Uniform(random, 0.5, 3))});
    }
  }
}

cv::Mat TexturedGround::Render(const CameraModel& camera, const Pose& T_world_cam) const {
  cv::Mat image(camera.height, camera.width, CV_8UC3, cv::Scalar(160, 150, 140));
  const Eigen::Matrix3d R = T_world_cam.rotation().toRotationMatrix();
  const Eigen::Vector3d& eye = T_world_cam.translation();
  const FisheyeAngles angles(camera.distortion);
  const auto rays = [&](const Eigen::Vector2d& pixel) -> Eigen::Vector3d {
    Eigen::Vector3d ray = camera.Unproject(pixel);
    const double radius = ray.head<2>().norm();
    if (camera.lens != LensModel::kFisheye || radius == 0) return ray;
    const double angle = angles.At(radius).value();
    ray.head<2>() *= std::sin(angle) / radius;
    ray.z() = std::cos(angle);
    return ray;
  };
  for (int row = 0; row < camera.height; ++row) {
    for (int column = 0; column < camera.width; ++column) {
      const Eigen::Vector3d ray = R * rays({column, row});
      if (ray.z() >= 0) continue;  // sky
      double distance = -eye.z() / ray.z();
      int face = 2;  // the axis of the normal
      for (const Box& box : boxes_) {
        double enter = 0;
        double leave = distance;
        int enter_face = 2;
        for (int axis = 0; axis < 3; ++axis) {
          double first = (box.low[axis] - eye[axis]) / ray[axis];
          double last = (box.high[axis] - eye[axis]) / ray[axis];
          if (first > last) std::swap(first, last);
          if (first > enter) enter_face = axis;
          enter = std::max(enter, first);
          leave = std::min(leave, last);
        }
        if (enter >= leave || enter <= 0) continue;
        distance = enter;
        face = enter_face;
      }
      const Eigen::Vector3d p = eye + distance * ray;
      // Each face has its own part of the texture.
      const double grey = face == 0   ? 0.8 * Sample(texture_, p.y() + 5, p.z() + 9)
                          : face == 1 ? 0.6 * Sample(texture_, p.x() + 7, p.z() + 3)
                                      : Sample(texture_, p.x(), p.y() + 4 * p.z());
      const auto value = static_cast<std::uint8_t>(std::clamp(grey, 0.0, 255.0));
      image.at<cv::Vec3b>(row, column) = {value, value, value};
    }
  }
  return image;
}

Sequence FlyOver(const TexturedGround& ground, int num_frames) {
  Sequence sequence;
  for (int i = 0; i < num_frames; ++i) {
    // 2 % of the depth and half a degree a frame, in a slight curve.
    const double x = 0.25 * i;
    const Eigen::Vector3d eye(x, -2 + 0.5 * std::sin(0.1 * i), 10);
    sequence.T_world_cam.push_back(LookAt(eye, {0.6 * x + 1, 8, 0}));
    Frame frame;
    frame.index = i;
    frame.timestamp_s = 0.1 * i;
    frame.name = "frame " + std::to_string(i);
    frame.camera = SmallCamera();
    frame.bgr = ground.Render(frame.camera, sequence.T_world_cam.back());
    sequence.frames.push_back(frame);
  }
  return sequence;
}

cv::Mat TexturedGround::RenderRolling(const CameraModel& camera,
                                      const std::function<Pose(double)>& T_world_cam,
                                      double time_s) const {
  const bool by_columns = camera.shutter.reads_columns;
  cv::Mat image(camera.height, camera.width, CV_8UC3);
  for (int i = 0; i < (by_columns ? camera.width : camera.height); ++i) {
    CameraModel line = camera;
    (by_columns ? line.width : line.height) = 1;
    (by_columns ? line.cx : line.cy) -= i;
    const double share = LineShare(camera, Eigen::Vector2d::Constant(i), by_columns);
    const cv::Mat shown = Render(line, T_world_cam(time_s + share * camera.shutter.readout_s));
    shown.copyTo(by_columns ? image.col(i) : image.row(i));
  }
  return image;
}

Sequence FlyUnsteadily(const TexturedGround& ground, const CameraModel& sensor, int num_frames) {
  const auto pose = [](double t_s) {
    const double x = 2.5 * t_s;
    const Eigen::Vector3d eye(x, -2 + 0.5 * std::sin(t_s), 10);
    const Pose steady = LookAt(eye, {0.6 * x + 1, 8, 0});
    // A swing of 6 degrees about the vertical, a shake of .3 degrees at 3 Hz about all axes.
    const double shake = 0.005 * std::sin(19 * t_s);
    const Eigen::Vector3d turn(shake, 0.1 * std::sin(2 * t_s) + shake, 0.5 * shake);
    return Pose(steady.rotation() * RotationExp(turn), steady.translation());
  };
  Sequence sequence;
  for (int i = 0; i < num_frames; ++i) {
    Frame frame;
    frame.index = i;
    frame.timestamp_s = i / 30.;
    frame.name = "frame " + std::to_string(i);
    frame.camera = sensor;
    frame.camera.shutter = {};
    frame.sensor = sensor;
    frame.bgr = ground.RenderRolling(sensor, pose, frame.timestamp_s);
    sequence.T_world_cam.push_back(pose(frame.timestamp_s));
    sequence.frames.push_back(std::move(frame));
  }
  return sequence;
}

Frame BlackFrame(std::int64_t index) {
  Frame frame;
  frame.index = index;
  frame.timestamp_s = 0.1 * static_cast<double>(index);
  frame.name = "black frame";
  frame.camera = SmallCamera();
  frame.bgr = cv::Mat(frame.camera.height, frame.camera.width, CV_8UC3, cv::Scalar(0, 0, 0));
  return frame;
}

View MakeView(const CameraModel& camera, const std::vector<Eigen::Vector2d>& pixels) {
  View view;
  view.frame.camera = camera;
  std::mt19937_64 random(3);
  for (const Eigen::Vector2d& pixel : pixels) {
    Feature feature;
    feature.pixel = pixel;
    for (std::uint64_t& word : feature.descriptor) word = random();
    view.features.push_back(feature);
  }
  view.grid = FeatureGrid(view.features, camera.width, camera.height);
  view.points.assign(pixels.size(), std::nullopt);
  return view;
}

}  // namespace mono3d::tracking
