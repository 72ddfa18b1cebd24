// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/voxel_grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <unordered_map>

#include "geometry/cell_hash.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using Cell = std::array<std::int64_t, 3>;

// Sums over the points of a cell.
struct Sums {
  double weight = 0;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  Eigen::Vector3d colour = Eigen::Vector3d::Zero();
  float radius = 0;
  float confidence = 0;
  std::uint32_t observations = 0;
  std::uint32_t first_frame = std::numeric_limits<std::uint32_t>::max();
  std::uint8_t inferred = 1;  // where all of its points are
};

void RequireCloudAndVoxel(const PointCloud& cloud, double voxel_su) {
  if (!(voxel_su > 0) || !std::isfinite(voxel_su)) {
    throw Error(ErrorParts{.what = "edge of a voxel is not positive",
                           .where = "voxel grid",
                           .expected = "more than 0",
                           .found = std::to_string(voxel_su)});
  }
  for (const std::size_t size :
       {cloud.normals.size(), cloud.colours.size(), cloud.radii.size(), cloud.confidences.size(),
        cloud.observations.size(), cloud.inferred.size(), cloud.first_frames.size()}) {
    if (size == 0 || size == cloud.size()) continue;
    throw Error(ErrorParts{.what = "lists of a cloud differ in length",
                           .where = "voxel grid",
                           .expected = std::to_string(cloud.size()),
                           .found = std::to_string(size)});
  }
}

Cell CellOf(const Eigen::Vector3f& point, double voxel_su) {
  Cell cell{};
  constexpr double kOutermost = 1e18;  // of which a double no longer tells the neighbours apart
  for (int axis = 0; axis < 3; ++axis) {
    const double place = std::floor(static_cast<double>(point[axis]) / voxel_su);
    cell[static_cast<std::size_t>(axis)] =
        static_cast<std::int64_t>(std::clamp(place, -kOutermost, kOutermost));
  }
  return cell;
}

void Add(Sums& sums, const PointCloud& cloud, std::size_t i) {
  // Never 0, so that a cell of points without confidence has a mean.
  const double weight = cloud.confidences.empty() ? 1.0 : cloud.confidences[i] + 1e-6;
  sums.weight += weight;
  sums.point += weight * cloud.points[i].cast<double>();
  if (!cloud.normals.empty()) sums.normal += weight * cloud.normals[i].cast<double>();
  if (!cloud.colours.empty()) {
    const auto& [red, green, blue] = cloud.colours[i];
    sums.colour += weight * Eigen::Vector3d(red, green, blue);
  }
  if (!cloud.radii.empty()) sums.radius = std::max(sums.radius, cloud.radii[i]);
  if (!cloud.confidences.empty()) {
    sums.confidence = std::max(sums.confidence, cloud.confidences[i]);
  }
  if (!cloud.observations.empty()) {
    sums.observations = std::max(sums.observations, cloud.observations[i]);
  }
  if (!cloud.first_frames.empty()) {
    sums.first_frame = std::min(sums.first_frame, cloud.first_frames[i]);
  }
  if (!IsInferred(cloud, i)) sums.inferred = 0;
}

}  // namespace

PointCloud ThinToVoxels(const PointCloud& cloud, double voxel_su) {
  RequireCloudAndVoxel(cloud, voxel_su);
  std::unordered_map<Cell, std::size_t, CellHash<3>> place_of;
  std::vector<Sums> cells;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const auto [entry, is_new] =
        place_of.try_emplace(CellOf(cloud.points[i], voxel_su), cells.size());
    if (is_new) cells.emplace_back();
    Add(cells[entry->second], cloud, i);
  }
  // Half the diagonal of a cell's face.
  const auto closing_radius = static_cast<float>(voxel_su / std::sqrt(2.0));
  PointCloud thin;
  for (const Sums& sums : cells) {
    thin.points.emplace_back((sums.point / sums.weight).cast<float>());
    // Two sides of a thin wall may cancel out.
    const Eigen::Vector3d normal = sums.normal.stableNormalized();
    if (!cloud.normals.empty()) thin.normals.emplace_back(normal.cast<float>());
    if (!cloud.colours.empty()) {
      std::array<std::uint8_t, 3> colour{};
      for (int c = 0; c < 3; ++c) {
        colour[static_cast<std::size_t>(c)] =
            static_cast<std::uint8_t>(std::lround(sums.colour[c] / sums.weight));
      }
      thin.colours.push_back(colour);
    }
    if (!cloud.radii.empty()) thin.radii.push_back(std::max(sums.radius, closing_radius));
    if (!cloud.confidences.empty()) thin.confidences.push_back(sums.confidence);
    if (!cloud.observations.empty()) thin.observations.push_back(sums.observations);
    if (!cloud.inferred.empty()) thin.inferred.push_back(sums.inferred);
    if (!cloud.first_frames.empty()) thin.first_frames.push_back(sums.first_frame);
  }
  return thin;
}

}  // namespace mono3d
