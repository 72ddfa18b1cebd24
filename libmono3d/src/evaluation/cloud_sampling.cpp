// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "evaluation/cloud_sampling.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace mono3d {
namespace {

constexpr int kMaxSizes = 12;         // voxel sizes to try
constexpr double kLowShare = 0.7;     // of max_points: a size that leaves fewer is too large
constexpr double kAimedShare = 0.85;  // of max_points
constexpr std::int64_t kMaxCell = (1 << 20) - 1;  // 21 bits per axis, with sign

std::uint64_t VoxelKey(const Eigen::Vector3d& offset, double voxel_size) {
  std::uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double cell = std::clamp(std::floor(offset[axis] / voxel_size),
                                   -static_cast<double>(kMaxCell), static_cast<double>(kMaxCell));
    key = (key << 21) | static_cast<std::uint64_t>(static_cast<std::int64_t>(cell) + kMaxCell);
  }
  return key;
}

std::vector<std::uint32_t> FirstOfEachVoxel(std::span<const Eigen::Vector3d> points,
                                            const Eigen::Vector3d& centre, double voxel_size) {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> cells(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    cells[i] = {VoxelKey(points[i] - centre, voxel_size), static_cast<std::uint32_t>(i)};
  }
  std::ranges::sort(cells);
  std::vector<std::uint32_t> first;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (i == 0 || cells[i].first != cells[i - 1].first) first.push_back(cells[i].second);
  }
  return first;
}

}  // namespace

std::vector<std::uint32_t> SampleEvenly(std::span<const Eigen::Vector3d> points,
                                        std::size_t max_points) {
  std::vector<std::uint32_t> sample(points.size());
  std::iota(sample.begin(), sample.end(), 0U);
  if (points.size() <= max_points) return sample;

  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points) centre += point;
  centre /= static_cast<double>(points.size());
  double sum_of_squares = 0;
  for (const Eigen::Vector3d& point : points) sum_of_squares += (point - centre).squaredNorm();
  const double radius = std::sqrt(sum_of_squares / static_cast<double>(points.size()));

  const auto wanted = static_cast<double>(max_points);
  double voxel_size = 2 * radius / std::sqrt(wanted);
  for (int i = 0; i < kMaxSizes && voxel_size > 0; ++i) {
    sample = FirstOfEachVoxel(points, centre, voxel_size);
    const auto count = static_cast<double>(sample.size());
    if (count <= wanted && count >= kLowShare * wanted) return sample;
    // A surface has one voxel per square of the size.
    voxel_size *= std::sqrt(count / (kAimedShare * wanted));
  }
  if (sample.size() <= max_points) return sample;
  std::vector<std::uint32_t> thinned(max_points);  // no size fits: every so many-th point
  for (std::size_t i = 0; i < max_points; ++i) thinned[i] = sample[i * sample.size() / max_points];
  return thinned;
}

}  // namespace mono3d
