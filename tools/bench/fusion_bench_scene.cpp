// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "bench/fusion_bench_scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace mono3d::tools {
namespace {

using Eigen::Vector3d;

constexpr double kHeight_su = 10;
constexpr double kTiltDeg = 60;  // of the line of sight below the horizon
constexpr double kFocalPerWidth = 0.9;
constexpr double kNoise_px = 0.25;
constexpr double kBaselinePerDepth = 0.15;
constexpr int kHoleSize_px = 16;
constexpr double kHoleShare = 0.05;
constexpr float kConfidence = 0.7F;

double Wave(const Vector3d& p, double x, double y, double z, double length_su) {
  return std::sin(2 * std::numbers::pi * (x * p.x() + y * p.y() + z * p.z()) / length_su);
}

// World: z up.
double Height(const Vector3d& p) {
  return 0.5 * Wave(p, 0.9, 0.4, 0, 6) + 0.2 * Wave(p, -0.3, 0.95, 0, 2.7);
}

Vector3d Normal(const Vector3d& p) {
  constexpr double kStep_su = 1e-3;
  const double dx = Height(p + Vector3d(kStep_su, 0, 0)) - Height(p - Vector3d(kStep_su, 0, 0));
  const double dy = Height(p + Vector3d(0, kStep_su, 0)) - Height(p - Vector3d(0, kStep_su, 0));
  return Vector3d(-dx, -dy, 2 * kStep_su).normalized();
}

// Waves from 4 su down to a few pixels.
double Grey(const Vector3d& p) {
  return 128 + 25 * Wave(p, 0.8, 0.5, 0.3, 4) + 25 * Wave(p, -0.4, 0.9, 0.5, 1.3) +
         25 * Wave(p, 0.9, -0.2, 0.7, 0.4) + 20 * Wave(p, 0.1, 0.8, -0.9, 0.1);
}

// Depth at which a ray, of z = 1 in the camera, meets the ground.
double Meet(const Vector3d& origin, const Vector3d& ray) {
  double depth_su = -origin.z() / ray.z();
  for (int i = 0; i < 12; ++i) {  // the waves are flat enough for each step to gain a digit
    const Vector3d p = origin + depth_su * ray;
    depth_su -= (p.z() - Height(p)) / ray.z();
  }
  return depth_su;
}

Pose FlightPose(const CameraModel& camera, int index, double new_share) {
  const double tilt = kTiltDeg * std::numbers::pi / 180;
  const double depth_su = kHeight_su / std::sin(tilt);
  Eigen::Matrix3d R_world_cam;
  R_world_cam.col(0) = Vector3d::UnitX();
  R_world_cam.col(2) = Vector3d(0, std::cos(tilt), -std::sin(tilt));
  R_world_cam.col(1) = R_world_cam.col(2).cross(R_world_cam.col(0));
  const double step_su = new_share * depth_su * camera.width / camera.fx;
  return {R_world_cam, Vector3d(index * step_su, 0, kHeight_su)};
}

// Without an estimate, per block of pixels.
std::vector<bool> Holes(const CameraModel& camera, std::mt19937& random) {
  const int columns = camera.width / kHoleSize_px + 1;
  const int rows = camera.height / kHoleSize_px + 1;
  std::bernoulli_distribution is_hole(kHoleShare);
  std::vector<bool> holes;
  for (int i = 0; i < columns * rows; ++i) holes.push_back(is_hole(random));
  return holes;
}

}  // namespace

PosedDepthMap WavyGroundMap(int width_px, int height_px, int index, double new_share) {
  PosedDepthMap posed;
  DepthMap& map = posed.map;
  CameraModel& camera = map.camera;
  camera.width = width_px;
  camera.height = height_px;
  camera.fx = camera.fy = kFocalPerWidth * width_px;
  camera.cx = 0.5 * (width_px - 1);
  camera.cy = 0.5 * (height_px - 1);
  posed.T_world_cam = FlightPose(camera, index, new_share);
  map.keyframe_id = map.frame_index = index;
  map.depth = cv::Mat::zeros(height_px, width_px, CV_32FC1);
  map.normal = cv::Mat::zeros(height_px, width_px, CV_32FC3);
  map.confidence = cv::Mat::zeros(height_px, width_px, CV_32FC1);
  map.bgr = cv::Mat(height_px, width_px, CV_8UC3);
  const double baseline_su = kBaselinePerDepth * kHeight_su;
  map.depth_sigma_per_square_depth = 1 / (camera.fx * baseline_su);
  std::mt19937 random(static_cast<unsigned>(index));
  const std::vector<bool> holes = Holes(camera, random);
  const int hole_columns = width_px / kHoleSize_px + 1;
  std::normal_distribution<double> noise(0, kNoise_px * map.depth_sigma_per_square_depth);
  const Eigen::Matrix3d R = posed.T_world_cam.rotation().toRotationMatrix();
  for (int y = 0; y < height_px; ++y) {
    for (int x = 0; x < width_px; ++x) {
      const Vector3d ray = R * camera.Unproject({x, y});
      const double depth_su = Meet(posed.T_world_cam.translation(), ray);
      const Vector3d p = posed.T_world_cam.translation() + depth_su * ray;
      const auto grey = static_cast<unsigned char>(std::clamp(Grey(p), 0.0, 255.0));
      map.bgr.at<cv::Vec3b>(y, x) = cv::Vec3b(grey, grey, grey);
      const int block = y / kHoleSize_px * hole_columns + x / kHoleSize_px;
      if (holes[static_cast<std::size_t>(block)]) continue;
      const Vector3d n_cam = R.transpose() * Normal(p);
      map.depth.at<float>(y, x) = static_cast<float>(1 / (1 / depth_su + noise(random)));
      map.normal.at<cv::Vec3f>(y, x) =
          cv::Vec3f(static_cast<float>(n_cam.x()), static_cast<float>(n_cam.y()),
                    static_cast<float>(n_cam.z()));
      map.confidence.at<float>(y, x) = kConfidence;
    }
  }
  return posed;
}

PosedDepthMap Misplaced(const PosedDepthMap& posed, double error_px, int index) {
  const double angle_rad = 2.4 * index;  // far from those of the maps before
  const Vector3d across(std::cos(angle_rad), std::sin(angle_rad), 0);
  const double turn_rad = 0.5 * error_px / posed.map.camera.fx;
  PosedDepthMap misplaced = posed;
  misplaced.T_world_cam =
      posed.T_world_cam * Pose(RotationExp(turn_rad * Vector3d(across.y(), -across.x(), 0)),
                               turn_rad * kHeight_su * across);
  return misplaced;
}

}  // namespace mono3d::tools
