// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/distortion.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace mono3d {
namespace {

Eigen::Vector2d ProjectFisheye(const CameraModel& camera, const Eigen::Vector3d& p_cam) {
  const double r = std::hypot(p_cam.x(), p_cam.y());
  const double theta = std::atan2(r, p_cam.z());
  const double scale = r > 0 ? FisheyeRadius(camera.distortion, theta) / r : 0;
  return {camera.fx * scale * p_cam.x() + camera.cx, camera.fy * scale * p_cam.y() + camera.cy};
}

}  // namespace

Eigen::Vector2d ProjectDistorted(const CameraModel& camera, const Eigen::Vector3d& p_cam) {
  if (camera.lens == LensModel::kFisheye) return ProjectFisheye(camera, p_cam);
  const double x = p_cam.x() / p_cam.z();
  const double y = p_cam.y() / p_cam.z();
  const auto [k1, k2, p1, p2, k3] = camera.distortion;
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const double x_distorted = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x);
  const double y_distorted = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;
  return {camera.fx * x_distorted + camera.cx, camera.fy * y_distorted + camera.cy};
}

double FisheyeRadius(const std::array<double, 5>& distortion, double theta) {
  const double t2 = theta * theta;
  const auto& k = distortion;
  return theta * (1 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))));
}

double FisheyeRadiusSlope(const std::array<double, 5>& distortion, double theta) {
  const double t2 = theta * theta;
  const auto& k = distortion;
  return 1 + t2 * (3 * k[0] + t2 * (5 * k[1] + t2 * (7 * k[2] + t2 * 9 * k[3])));
}

FisheyeAngles::FisheyeAngles(const std::array<double, 5>& distortion) : distortion_(distortion) {
  double theta = 0;
  do {
    radii_.push_back(FisheyeRadius(distortion, theta));
    theta = kStep_rad * static_cast<double>(radii_.size());
  } while (theta < std::numbers::pi && FisheyeRadiusSlope(distortion, theta) > 0 &&
           FisheyeRadius(distortion, theta) > radii_.back());
}

std::optional<double> FisheyeAngles::At(double radius) const {
  if (!(radius >= 0 && radius <= radii_.back())) return std::nullopt;
  const auto above = std::lower_bound(radii_.begin(), radii_.end(), radius);
  if (*above == radius) return kStep_rad * static_cast<double>(above - radii_.begin());
  const double most = kStep_rad * static_cast<double>(above - radii_.begin());
  const double least = most - kStep_rad;
  // Newton's method; between two steps the radius is nearly a straight line.
  constexpr int kRounds = 5;
  double theta = least + kStep_rad * (radius - *(above - 1)) / (*above - *(above - 1));
  for (int i = 0; i < kRounds; ++i) {
    theta -= (FisheyeRadius(distortion_, theta) - radius) / FisheyeRadiusSlope(distortion_, theta);
    theta = std::clamp(theta, least, most);
  }
  return theta;
}

std::optional<Eigen::Vector3d> UnprojectDistorted(const CameraModel& camera,
                                                  const Eigen::Vector2d& pixel) {
  const Eigen::Vector3d straight = camera.Unproject(pixel);
  if (camera.lens == LensModel::kFisheye) {
    const double radius = straight.head<2>().norm();
    const std::optional<double> angle = FisheyeAngles(camera.distortion).At(radius);
    // At z = 1 there is nothing that looks sideways.
    constexpr double kMostAngle_rad = 89 * std::numbers::pi / 180;
    if (!angle || *angle > kMostAngle_rad) return std::nullopt;
    const double scale = radius > 0 ? std::tan(*angle) / radius : 1;
    return Eigen::Vector3d(scale * straight.x(), scale * straight.y(), 1);
  }
  // Newton's method with differences: what a lens does to a pixel is smooth over a thousandth.
  constexpr int kRounds = 30;
  constexpr double kStep = 1e-6;
  constexpr double kSettled_px = 1e-6;
  Eigen::Vector3d ray = straight;
  for (int round = 0; round < kRounds; ++round) {
    const Eigen::Vector2d error = pixel - ProjectDistorted(camera, ray);
    if (error.norm() < kSettled_px) return ray;
    Eigen::Matrix2d by_ray;
    for (int k = 0; k < 2; ++k) {
      const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(k);
      by_ray.col(k) =
          (ProjectDistorted(camera, ray + step) - ProjectDistorted(camera, ray - step)) /
          (2 * kStep);
    }
    const double determinant = by_ray.determinant();
    if (!std::isfinite(determinant) || determinant <= 0) return std::nullopt;  // it folds back
    ray.head<2>() += by_ray.inverse() * error;
    if (!ray.allFinite()) return std::nullopt;
  }
  return std::nullopt;
}

}  // namespace mono3d
