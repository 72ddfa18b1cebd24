// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "mono3d/evaluation/cloud_search.h"
#include "mono3d/geometry/point_cloud.h"

namespace mono3d {

// A cloud as a surface to measure against: its points, a plane through each and the search for the
// nearest one.
class CloudSurface {
 public:
  // Normals are those of the cloud, or fitted to `num_normal_neighbours` points. `cloud` must pass
  // CheckCloud.
  CloudSurface(const PointCloud& cloud, int num_normal_neighbours);

  std::span<const Eigen::Vector3d> points() const { return points_; }
  // Unit length; 0 where the neighbours of a point form no plane.
  std::span<const Eigen::Vector3f> normals() const { return normals_; }
  // Are the normals the cloud's own, pointing outwards? Fitted ones may point either way.
  bool has_outward_normals() const { return has_outward_normals_; }
  // Median distance of a point to its nearest neighbour, over at most 20,000 points; 0 for one
  // point.
  double spacing() const { return spacing_; }
  // Index of the nearest point for each query.
  std::vector<std::uint32_t> Nearest(std::span<const Eigen::Vector3d> queries) const {
    return search_.Nearest(queries);
  }

 private:
  std::vector<Eigen::Vector3d> points_;
  CloudSearch search_;
  std::vector<Eigen::Vector3f> normals_;
  bool has_outward_normals_ = false;
  double spacing_ = 0;
};

}  // namespace mono3d
