// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/evaluation/normal_error.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "evaluation/depth_pixels.h"
#include "geometry/angles.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

Eigen::Vector3d PointAt(const cv::Mat& depth, const CameraModel& camera, int x, int y) {
  return depth.at<float>(y, x) * camera.Unproject({x, y});
}

// The plane g with g . p = 1 for the points of the window: 1 / z = g . (ray at z = 1). The fit of
// 1 / z over a full window is that of a plane over a regular grid, whose sums are known.
std::optional<Eigen::Vector3d> FitPlane(const cv::Mat& depth, const CameraModel& camera, int x,
                                        int y, int radius) {
  double sum = 0;
  double sum_x = 0;
  double sum_y = 0;
  double sum_of_squares = 0;  // of the offsets, along x as along y
  for (int dy = -radius; dy <= radius; ++dy) {
    for (int dx = -radius; dx <= radius; ++dx) {
      const float z = depth.at<float>(y + dy, x + dx);
      if (!IsDepth(z)) return std::nullopt;
      sum += 1.0 / z;
      sum_x += dx / static_cast<double>(z);
      sum_y += dy / static_cast<double>(z);
      sum_of_squares += dx * dx;
    }
  }
  const int side = 2 * radius + 1;
  const double slope_x = sum_x / sum_of_squares;  // of 1 / z, per pixel
  const double slope_y = sum_y / sum_of_squares;
  const double middle = sum / (side * side);
  const Eigen::Vector3d ray = camera.Unproject({x, y});
  const double g_x = slope_x * camera.fx;
  const double g_y = slope_y * camera.fy;
  return Eigen::Vector3d(g_x, g_y, middle - g_x * ray.x() - g_y * ray.y());
}

bool WindowLiesOnPlane(const cv::Mat& depth, const CameraModel& camera, int x, int y,
                       const Eigen::Vector3d& plane, const TrueNormalOptions& options) {
  const double footprint = depth.at<float>(y, x) / camera.fx;
  const double max_distance = options.max_plane_distance_footprints * footprint * plane.norm();
  const int radius = options.radius_px;
  for (int dy = -radius; dy <= radius; ++dy) {
    for (int dx = -radius; dx <= radius; ++dx) {
      const double excess = plane.dot(PointAt(depth, camera, x + dx, y + dy)) - 1;
      if (std::abs(excess) > max_distance) return false;
    }
  }
  return true;
}

void RequireNormalOption(bool holds, const char* what, const char* expected, double found) {
  if (holds) return;
  throw Error(
      ErrorParts{.what = what, .where = {}, .expected = expected, .found = std::to_string(found)});
}

}  // namespace

cv::Mat NormalsFromDepth(const cv::Mat& depth, const CameraModel& camera,
                         const TrueNormalOptions& options) {
  RequireImage(depth, "the true depth", CV_32FC1, cv::Size(camera.width, camera.height));
  RequireNormalOption(options.radius_px >= 1, "bad radius of the window for normals",
                      "1 px or more", options.radius_px);
  RequireNormalOption(options.max_plane_distance_footprints > 0,
                      "bad bound on the distance from a plane", "more than 0",
                      options.max_plane_distance_footprints);
  cv::Mat normals(depth.size(), CV_32FC3, cv::Scalar::all(0));
  const int radius = options.radius_px;
  for (int y = radius; y < depth.rows - radius; ++y) {
    for (int x = radius; x < depth.cols - radius; ++x) {
      const auto plane = FitPlane(depth, camera, x, y, radius);
      if (!plane || !WindowLiesOnPlane(depth, camera, x, y, *plane, options)) continue;
      // The plane is in front of the camera: g . p = 1 > 0, so -g points back to it.
      const Eigen::Vector3f normal = -plane->normalized().cast<float>();
      normals.at<cv::Vec3f>(y, x) = {normal.x(), normal.y(), normal.z()};
    }
  }
  return normals;
}

cv::Mat SlantedSurfaces(const cv::Mat& normals, const CameraModel& camera, double min_angle_deg) {
  RequireImage(normals, "the normals", CV_32FC3, {camera.width, camera.height});
  RequireNormalOption(min_angle_deg >= 0 && min_angle_deg <= 90, "bad angle of slanted surfaces",
                      "0 to 90 degrees", min_angle_deg);
  const double max_cosine = std::cos(min_angle_deg / kDegreesPerRadian);
  cv::Mat slanted(normals.size(), CV_8UC1, cv::Scalar(0));
  for (int y = 0; y < normals.rows; ++y) {
    for (int x = 0; x < normals.cols; ++x) {
      const auto& n = normals.at<cv::Vec3f>(y, x);
      const Eigen::Vector3d n_cam(n[0], n[1], n[2]);
      const double cosine = -n_cam.dot(camera.Unproject({x, y}).normalized());
      if (n_cam.norm() > 0 && cosine < max_cosine * n_cam.norm()) slanted.at<uchar>(y, x) = 255;
    }
  }
  return slanted;
}

NormalError CompareNormals(const cv::Mat& estimate, const cv::Mat& truth) {
  RequireImage(truth, "the map of true normals", CV_32FC3, truth.size());
  RequireImage(estimate, "the map of estimated normals", CV_32FC3, truth.size());
  NormalError error;
  std::vector<double> angles_deg;
  for (int y = 0; y < truth.rows; ++y) {
    for (int x = 0; x < truth.cols; ++x) {
      const cv::Vec3d n_true = truth.at<cv::Vec3f>(y, x);
      if (!(n_true.dot(n_true) > 0)) continue;
      ++error.num_true_pixels;
      const cv::Vec3d n = estimate.at<cv::Vec3f>(y, x);
      if (!(n.dot(n) > 0)) continue;
      // Exact for small angles as well, unlike the arc cosine.
      angles_deg.push_back(kDegreesPerRadian *
                           std::atan2(cv::norm(n.cross(n_true)), n.dot(n_true)));
    }
  }
  error.angle_deg = ComputeStatistics(angles_deg);
  error.num_pixels = error.angle_deg.count;
  if (error.num_true_pixels > 0) {
    error.density =
        static_cast<double>(error.num_pixels) / static_cast<double>(error.num_true_pixels);
  }
  if (error.num_pixels == 0) return error;
  const auto share_below = [&](double bound_deg) {
    const auto below = std::count_if(angles_deg.begin(), angles_deg.end(),
                                     [=](double a) { return a < bound_deg; });
    return static_cast<double>(below) / static_cast<double>(angles_deg.size());
  };
  error.share_below_11_25_deg = share_below(11.25);
  error.share_below_22_5_deg = share_below(22.5);
  error.share_below_30_deg = share_below(30);
  return error;
}

NormalError MeanNormalError(std::span<const NormalError> errors) {
  constexpr double NormalError::*kShares[] = {&NormalError::share_below_11_25_deg,
                                              &NormalError::share_below_22_5_deg,
                                              &NormalError::share_below_30_deg};
  constexpr double ErrorStatistics::*kFigures[] = {&ErrorStatistics::rmse, &ErrorStatistics::mean,
                                                   &ErrorStatistics::median,
                                                   &ErrorStatistics::sigma};
  NormalError mean;
  double num_with_truth = 0;
  double num_compared = 0;
  for (const NormalError& error : errors) {
    mean.num_true_pixels += error.num_true_pixels;
    mean.num_pixels += error.num_pixels;
    if (error.num_true_pixels == 0) continue;
    ++num_with_truth;
    mean.density += error.density;
    if (error.num_pixels == 0) continue;
    ErrorStatistics& angle = mean.angle_deg;
    const bool is_first = num_compared == 0;
    angle.min = is_first ? error.angle_deg.min : std::min(angle.min, error.angle_deg.min);
    angle.max = std::max(angle.max, error.angle_deg.max);
    ++num_compared;
    for (const auto figure : kFigures) angle.*figure += error.angle_deg.*figure;
    for (const auto share : kShares) mean.*share += error.*share;
  }
  mean.angle_deg.count = mean.num_pixels;
  if (num_with_truth > 0) mean.density /= num_with_truth;
  if (num_compared == 0) return mean;
  for (const auto figure : kFigures) mean.angle_deg.*figure /= num_compared;
  for (const auto share : kShares) mean.*share /= num_compared;
  return mean;
}

}  // namespace mono3d
