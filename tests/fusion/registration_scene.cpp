// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/registration_scene.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

namespace mono3d {
namespace {

using Eigen::Vector3d;

constexpr double kDistance_su = 10;
constexpr double kHeight_su = 6;

// A convex polygon cut out of a plane: points with direction.p <= limit for all cuts.
struct Facet {
  Vector3d normal;
  double offset;
  std::array<Vector3d, 4> cuts;
  std::array<double, 4> limits;
};

std::array<Facet, 6> HouseFacets() {
  const Vector3d x = Vector3d::UnitX(), y = Vector3d::UnitY(), z = Vector3d::UnitZ();
  // Length 4 along x, width 3, walls 2 high, ridge 3 high.
  const Vector3d roof_front = Vector3d(0, 1, 1.5).normalized();
  const Vector3d roof_back = Vector3d(0, -1, 1.5).normalized();
  const double roof_offset = roof_front.dot(Vector3d(0, 1.5, 2));
  const std::array<double, 4> wall_limits = {2, 2, 2, 0};
  const std::array<double, 4> gable_limits = {1.5, 1.5, roof_offset, roof_offset};
  const std::array<double, 4> roof_limits = {2, 2, 1.5, 0};
  return {{{y, 1.5, {x, -x, z, -z}, wall_limits},
           {-y, 1.5, {x, -x, z, -z}, wall_limits},
           {x, 2, {y, -y, roof_front, roof_back}, gable_limits},
           {-x, 2, {y, -y, roof_front, roof_back}, gable_limits},
           {roof_front, roof_offset, {x, -x, y, -y}, roof_limits},
           {roof_back, roof_offset, {x, -x, -y, y}, roof_limits}}};
}

std::optional<double> Meet(const Facet& facet, const Vector3d& origin, const Vector3d& ray) {
  const double along = facet.normal.dot(ray);
  if (along >= 0) return std::nullopt;
  const double distance = (facet.offset - facet.normal.dot(origin)) / along;
  const Vector3d p = origin + distance * ray;
  if (distance <= 0 || p.z() < 0) return std::nullopt;
  for (std::size_t i = 0; i < facet.cuts.size(); ++i) {
    if (facet.cuts[i].dot(p) > facet.limits[i]) return std::nullopt;
  }
  return distance;
}

double FirstSurface(const HouseScene& scene, const Vector3d& origin, const Vector3d& ray) {
  double nearest = ray.z() < 0 ? -origin.z() / ray.z() : 0;
  if (!scene.with_house) return nearest;
  for (const Facet& facet : HouseFacets()) {
    const auto distance = Meet(facet, origin, ray);
    if (distance && (nearest == 0 || *distance < nearest)) nearest = *distance;
  }
  return nearest;
}

// Waves from 4 to 1 su long; a pixel is about 0.08 su.
double Grey(const Vector3d& p) {
  const auto wave = [&](const Vector3d& direction, double length_su) {
    return std::sin(2 * std::numbers::pi * direction.dot(p) / length_su);
  };
  return 128 + 25 * wave({0.8, 0.5, 0.3}, 4) + 25 * wave({-0.4, 0.9, 0.5}, 2.3) +
         25 * wave({0.9, -0.2, 0.7}, 1.4) + 20 * wave({0.1, 0.8, -0.9}, 1);
}

Pose CameraLookingAt(const Vector3d& eye, const Vector3d& place) {
  Eigen::Matrix3d R_world_cam;
  R_world_cam.col(2) = (place - eye).normalized();
  R_world_cam.col(0) = R_world_cam.col(2).cross(Vector3d::UnitZ()).normalized();
  R_world_cam.col(1) = R_world_cam.col(2).cross(R_world_cam.col(0));
  return {R_world_cam, eye};
}

}  // namespace

CameraModel HouseCamera() {
  CameraModel camera;
  camera.width = 144;
  camera.height = 96;
  camera.fx = camera.fy = 125;
  camera.cx = 71.5;
  camera.cy = 47.5;
  return camera;
}

Pose PoseOver(double x_su, double y_su) {
  return CameraLookingAt({x_su, y_su + kDistance_su, kHeight_su}, {x_su, y_su, 1});
}

TrackedMap HouseView(const HouseScene& scene, double angle_deg) {
  const double angle = angle_deg * std::numbers::pi / 180;
  const Vector3d eye(kDistance_su * std::sin(angle), kDistance_su * std::cos(angle), kHeight_su);
  return HouseViewFrom(scene, CameraLookingAt(eye, {0, 0, 1}));
}

TrackedMap HouseViewFrom(const HouseScene& scene, const Pose& pose) {
  TrackedMap map;
  map.camera = HouseCamera();
  map.depth = cv::Mat::zeros(map.camera.height, map.camera.width, CV_32FC1);
  map.bgr = cv::Mat(map.camera.height, map.camera.width, CV_8UC3, cv::Scalar(128, 128, 128));
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      const Vector3d ray = pose.rotation() * map.camera.Unproject({x, y});
      const double depth = FirstSurface(scene, pose.translation(), ray);
      if (depth <= 0) continue;
      map.depth.at<float>(y, x) = static_cast<float>(scene.world_scale * depth);
      if (!scene.with_texture) continue;
      const auto grey = static_cast<unsigned char>(
          std::clamp(Grey(pose.translation() + depth * ray), 0.0, 255.0));
      map.bgr.at<cv::Vec3b>(y, x) = cv::Vec3b(grey, grey, grey);
    }
  }
  map.T_world_cam = Pose(pose.rotation(), scene.world_scale * pose.translation());
  // A baseline of a tenth of the distance.
  map.depth_sigma_per_square_depth = 1 / (map.camera.fx * scene.world_scale);
  return map;
}

TrackedMap Misplaced(const TrackedMap& map, const Eigen::Vector3d& rotation_rad,
                     const Eigen::Vector3d& translation_su, double scale) {
  TrackedMap misplaced = map;
  misplaced.T_world_cam = map.T_world_cam * Pose(RotationExp(rotation_rad), translation_su);
  misplaced.depth = cv::Mat(map.depth / scale);
  misplaced.depth_sigma_per_square_depth = map.depth_sigma_per_square_depth * scale;
  return misplaced;
}

double ImageDistance_px(const Pose& a, const Pose& b, double world_scale) {
  const CameraModel camera = HouseCamera();
  const Pose between = a.Inverse() * b;
  double largest = 0;
  for (const auto& [x, y] : {std::pair{20, 20}, {120, 20}, {20, 80}, {120, 80}}) {
    const Vector3d p = kDistance_su * world_scale * camera.Unproject({x, y});
    const Vector3d q = between * p;
    largest = std::max(largest, std::hypot(camera.fx * (q.x() / q.z() - p.x() / p.z()),
                                           camera.fy * (q.y() / q.z() - p.y() / p.z())));
  }
  return largest;
}

double FalseShare(const PointCloud& model, const std::vector<TrackedMap>& truth) {
  double num_false = 0;
  double num_seen = 0;
  for (const TrackedMap& view : truth) {
    const Pose T_cam_world = view.T_world_cam.Inverse();
    for (const auto& point : model.points) {
      const Vector3d p = T_cam_world * point.cast<double>();
      if (p.z() <= 0) continue;
      const long x = std::lround(view.camera.fx * p.x() / p.z() + view.camera.cx);
      const long y = std::lround(view.camera.fy * p.y() / p.z() + view.camera.cy);
      if (x < 0 || y < 0 || x >= view.camera.width || y >= view.camera.height) continue;
      const float depth = view.depth.at<float>(static_cast<int>(y), static_cast<int>(x));
      if (depth <= 0) continue;
      num_seen += 1;
      num_false += p.z() < 0.95 * depth ? 1 : 0;
    }
  }
  return num_seen > 0 ? num_false / num_seen : 1;
}

}  // namespace mono3d
