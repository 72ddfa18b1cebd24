// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/image/common_camera.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/image/undistorter.h"

namespace mono3d {
namespace {

constexpr double kMaxPixelsOfLargest = 2;
// A pixel centre that lies on the border but for rounding.
constexpr double kFieldRounding_px = 1e-6;

// The lower median over the photos.
double MedianFocal(std::vector<std::pair<double, int>> focals) {
  std::ranges::sort(focals);
  int num_photos = 0;
  for (const auto& focal : focals) num_photos += focal.second;
  int num_below = 0;
  for (const auto& [focal, num] : focals) {
    num_below += num;
    if (2 * num_below >= num_photos) return focal;
  }
  return focals.back().first;
}

// Pixels from one side of the field to the other.
int NumPixels(double extent, double focal) {
  return static_cast<int>(std::floor(extent * focal + kFieldRounding_px)) + 1;
}

// With which the field has so many pixels: (x f + 1) (y f + 1) = n.
double FocalOfPixels(const Eigen::Vector2d& extent, double num_pixels) {
  const double product = extent.x() * extent.y();
  const double half_sum = extent.sum() / 2;
  return (std::sqrt(half_sum * half_sum + product * (num_pixels - 1)) - half_sum) / product;
}

}  // namespace

CameraModel CommonCamera(std::span<const PhotosOfCamera> cameras, int max_width, int max_height) {
  if (cameras.empty()) throw Error("common camera: of no camera");
  Eigen::AlignedBox2d field;  // at z = 1
  std::vector<std::pair<double, int>> focals;
  double largest = 0;  // photo, in pixels
  for (const auto& [taken, num_photos] : cameras) {
    const CameraModel camera = Undistorter(taken).camera();
    field.extend(camera.Unproject({0, 0}).head<2>());
    field.extend(camera.Unproject({camera.width - 1, camera.height - 1}).head<2>());
    focals.emplace_back(std::sqrt(camera.fx * camera.fy), std::max(num_photos, 1));
    largest = std::max(largest, double(camera.width) * camera.height);
  }
  const Eigen::Vector2d extent = field.sizes();
  double focal = MedianFocal(std::move(focals));
  focal = std::min(focal, FocalOfPixels(extent, kMaxPixelsOfLargest * largest));
  if (max_width > 0) focal = std::min(focal, (max_width - 1) / extent.x());
  if (max_height > 0) focal = std::min(focal, (max_height - 1) / extent.y());
  CameraModel common;
  common.width = NumPixels(extent.x(), focal);
  common.height = NumPixels(extent.y(), focal);
  common.fx = common.fy = focal;
  common.cx = -field.min().x() * focal;
  common.cy = -field.min().y() * focal;
  return common;
}

}  // namespace mono3d
