// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

// Exact nearest neighbours among fixed points, through FLANN's single k-d tree. Ties within float
// rounding of the cloud's extent are decided either way, but always alike.
class CloudSearch {
 public:
  // `points`: at least one, finite; they are copied.
  explicit CloudSearch(std::span<const Eigen::Vector3d> points);
  ~CloudSearch();
  CloudSearch(CloudSearch&&) noexcept;
  CloudSearch& operator=(CloudSearch&&) noexcept;

  // Indices of the `count` nearest points of each query, nearest first: `count` for the first
  // query, then those of the second. `count` is at most the number of points.
  std::vector<std::uint32_t> Nearest(std::span<const Eigen::Vector3d> queries, int count = 1) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace mono3d
