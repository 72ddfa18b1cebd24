// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <unordered_map>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/io/ply_reader.h"
#include "mono3d/products/map_axes.h"

namespace MONO3D_EXPORT mono3d {

// Some surfels of a model with their places on a map.
struct MapSurfelBlock {
  PointCloud cloud;                      // as model.ply has them, in its axes
  std::vector<Eigen::Vector3d> points;   // on the map
  std::vector<Eigen::Vector3f> normals;  // there, of unit length; empty where the cloud has none
};

// The surfels of model.ply in the axes of a map, block by block: the model is read as often as it
// is needed and never held as a whole. For one thread at a time.
class MapSurfels {
 public:
  // Reads the model once, for the bounds. `axes` must outlive it. Throws Error where the file
  // cannot be read or holds no surfels.
  MapSurfels(const std::filesystem::path& model, const MapAxes& axes);

  std::size_t size() const { return reader_.size(); }
  std::size_t num_blocks() const { return bounds_of_blocks_.size(); }
  const Eigen::AlignedBox3d& bounds() const { return bounds_; }
  const Eigen::AlignedBox3d& bounds(std::size_t block) const { return bounds_of_blocks_[block]; }
  double max_radius(std::size_t block) const { return max_radii_[block]; }  // units of the model
  // But for the outermost one of two thousand on each side, which may be far away.
  Eigen::AlignedBox2d BoundsOfMost() const;
  double median_radius() const { return median_radius_; }  // units of the model; 0: not known

  void Read(std::size_t block, MapSurfelBlock& surfels);

 private:
  const AffineMap& MapNear(const Eigen::Vector3d& p_model);

  const MapAxes& axes_;
  PlyReader reader_;
  std::unordered_map<std::uint64_t, AffineMap> maps_;  // by cells of the model
  std::vector<Eigen::AlignedBox3d> bounds_of_blocks_;
  std::vector<double> max_radii_;
  Eigen::AlignedBox3d bounds_;
  std::vector<float> sample_x_, sample_y_;  // from the least corner of the bounds
  double median_radius_ = 0;
};

}  // namespace mono3d
