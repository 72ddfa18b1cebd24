// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "evaluation/cloud_surface.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <opencv2/core/utility.hpp>
#include <utility>

#include "mono3d/core/error.h"
#include "mono3d/core/statistics.h"

namespace mono3d {
namespace {

constexpr std::size_t kSpacingSamples = 20000;
constexpr std::size_t kPointsPerBlock = 1 << 16;  // bounds the memory of the neighbour lists
// A line has no plane: the second extent of the neighbours over the first, both squared.
constexpr double kMinFlatness = 1e-6;

double MedianSpacing(std::span<const Eigen::Vector3d> points, const CloudSearch& search) {
  if (points.size() < 2) return 0;
  const std::size_t step = (points.size() + kSpacingSamples - 1) / kSpacingSamples;
  std::vector<Eigen::Vector3d> samples;
  for (std::size_t i = 0; i < points.size(); i += step) samples.push_back(points[i]);
  const std::vector<std::uint32_t> nearest = search.Nearest(samples, 2);
  std::vector<double> distances(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    distances[i] = (points[nearest[2 * i + 1]] - samples[i]).norm();
  }
  return UpperMedian(std::move(distances));
}

Eigen::Vector3f FitNormal(std::span<const Eigen::Vector3d> points,
                          std::span<const std::uint32_t> neighbours) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const std::uint32_t i : neighbours) mean += points[i];
  mean /= static_cast<double>(neighbours.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const std::uint32_t i : neighbours) {
    const Eigen::Vector3d offset = points[i] - mean;
    scatter += offset * offset.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter);
  if (!(solver.eigenvalues()[1] > kMinFlatness * solver.eigenvalues()[2])) {
    return Eigen::Vector3f::Zero();
  }
  return solver.eigenvectors().col(0).cast<float>();
}

std::vector<Eigen::Vector3f> FitNormals(std::span<const Eigen::Vector3d> points,
                                        const CloudSearch& search, int num_neighbours) {
  std::vector<Eigen::Vector3f> normals(points.size(), Eigen::Vector3f::Zero());
  const std::size_t count = std::min(static_cast<std::size_t>(num_neighbours), points.size());
  for (std::size_t begin = 0; begin < points.size(); begin += kPointsPerBlock) {
    const std::size_t size = std::min(kPointsPerBlock, points.size() - begin);
    const std::vector<std::uint32_t> neighbours =
        search.Nearest(points.subspan(begin, size), static_cast<int>(count));
    cv::parallel_for_(cv::Range(0, static_cast<int>(size)), [&](const cv::Range& range) {
      for (auto i = static_cast<std::size_t>(range.start); i < static_cast<std::size_t>(range.end);
           ++i) {
        normals[begin + i] = FitNormal(points, std::span(neighbours).subspan(i * count, count));
      }
    });
  }
  return normals;
}

// Normals of unit length, or 0 where they are too short to have a direction.
std::vector<Eigen::Vector3f> UnitNormals(const std::vector<Eigen::Vector3f>& normals) {
  std::vector<Eigen::Vector3f> unit(normals.size());
  std::ranges::transform(normals, unit.begin(),
                         [](const Eigen::Vector3f& normal) { return normal.normalized(); });
  return unit;
}

}  // namespace

CloudSurface::CloudSurface(const PointCloud& cloud, int num_normal_neighbours)
    : points_(CloudPoints(cloud)),
      search_(points_),
      normals_(cloud.normals.empty() ? FitNormals(points_, search_, num_normal_neighbours)
                                     : UnitNormals(cloud.normals)),
      has_outward_normals_(!cloud.normals.empty()),
      spacing_(MedianSpacing(points_, search_)) {}

}  // namespace mono3d
