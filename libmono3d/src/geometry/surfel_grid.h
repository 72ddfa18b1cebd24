// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "mono3d/geometry/point_cloud.h"

namespace mono3d {

using GridIndex = std::array<std::int32_t, 3>;

struct GridIndexHash {
  std::size_t operator()(const GridIndex& index) const {
    std::uint64_t hash = 0;
    for (const std::int32_t i : index) {
      hash = (hash ^ static_cast<std::uint32_t>(i)) * 0x9E3779B97F4A7C15ULL;
      hash ^= hash >> 32;
    }
    return hash;
  }
};

// The corners from `first` to `last`, both included.
struct GridBox {
  GridIndex first{};
  GridIndex last{};
};

// Beyond lies what no scene holds at its resolution.
inline constexpr std::int32_t kFarthestIndex = 1'000'000'000;

// A surfel speaks of corners up to so many cells away, at most.
inline constexpr int kFarthestReach = 4;

// What the surfels around a corner of the grid say: means by weight, once Finish was called.
struct GridCorner {
  GridIndex index{};
  float weight = 0;
  float distance = 0;  // to the surface, su; positive outside
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  Eigen::Vector3f colour = Eigen::Vector3f::Zero();
};

// Distances to a surface at the corners of a grid near its surfels, and nowhere else.
class SurfelGrid {
 public:
  // Of edge `voxel_su`, the corners of `box` alone; corner (0, 0, 0) is at `origin`.
  SurfelGrid(const Eigen::Vector3d& origin, double voxel_su, const GridBox& box);
  // All that there is, around the first surfel. `surfels` need normals and radii.
  SurfelGrid(const PointCloud& surfels, double voxel_su);

  // More surfels, as many times as there are; then Finish.
  void Add(const PointCloud& surfels);
  void Finish();

  const std::vector<GridCorner>& corners() const { return corners_; }
  std::optional<std::uint32_t> Find(const GridIndex& index) const;
  Eigen::Vector3f PointOf(const GridCorner& corner) const;
  // Does the box have the cell of which this is the lowest corner?
  bool IsLowest(const GridIndex& index) const;
  // Lies the edge between two corners on one of the planes that bound the box?
  bool IsOnBorder(const GridIndex& a, const GridIndex& b) const;

 private:
  void Add(const PointCloud& surfels, std::size_t i);

  double voxel_su_;
  Eigen::Vector3d origin_;  // indices stay small wherever the model lies
  GridBox box_;
  std::unordered_map<GridIndex, std::uint32_t, GridIndexHash> place_of_;
  std::vector<GridCorner> corners_;  // in the order of the surfels that reach them
};

}  // namespace mono3d
