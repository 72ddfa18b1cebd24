// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "synthetic/ground_map.h"
#include "synthetic/mesh.h"

namespace mono3d::synthetic {

struct TerrainOptions {
  double half_extent_m = 190;
  double relief_m = 9;
  double bumps_m = 1;        // banks and bumps of some metres' width, away from streets
  double flat_radius_m = 0;  // level ground around the origin
  std::uint32_t seed = 1;
};

// Height of the ground over the world's horizontal plane.
class Terrain {
 public:
  Terrain(const TerrainOptions& options, const GroundMap& ground);

  float HeightAt(const Eigen::Vector2f& p_m) const;
  Eigen::Vector3f At(const Eigen::Vector2f& p_m) const { return {p_m.x(), p_m.y(), HeightAt(p_m)}; }
  // A square of the given half extent, and coarser ground around it as far as the eye reaches.
  void AddTo(Mesh& mesh) const;

 private:
  float NaturalHeightAt(const Eigen::Vector2f& p_m) const;  // without level ground and water

  TerrainOptions options_;
  const GroundMap& ground_;  // not owned; must outlive this
};

}  // namespace mono3d::synthetic
