// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "synthetic/ground_map.h"
#include "synthetic/mesh.h"
#include "synthetic/noise.h"
#include "synthetic/scene.h"
#include "synthetic/terrain.h"

namespace mono3d::synthetic {

// Where something stands, and how much room it takes.
struct Plot {
  Eigen::Vector2f middle;
  float radius_m;
};

// What the parts of a scene share while it is built. The order of work: lay streets, water and
// paths, lay the terrain, then put things on it.
struct Site {
  explicit Site(std::uint32_t seed) : random(seed) { ground.seed = seed; }

  TerrainOptions terrain;
  GroundMap ground;
  std::vector<Polyline> streets;
  std::vector<Polyline> routes;  // streets that cars drive on: none crosses another
  std::vector<Plot> plots;       // taken
  Mesh mesh;
  std::vector<MovingObject> moving;
  RandomNumbers random;

  float Random(double low, double high) { return static_cast<float>(random.Uniform(low, high)); }
  // Height of the terrain; after LayTerrain.
  Eigen::Vector3f At(const Eigen::Vector2f& p_m) const;
  bool IsFree(const Plot& plot) const;  // of other plots, streets and water
};

// A winding line through `through` in the given direction.
struct WindingLine {
  Eigen::Vector2f through;
  float direction_rad;
  float half_length_m;
  float swing_m;
};
Polyline Winding(const WindingLine& line);

void LayStreets(Site& site, std::vector<Polyline> streets);
void LayPaths(Site& site, const std::vector<Polyline>& paths);
void LayTerrain(Site& site);

// A random place on open ground, or none in a few tries.
std::optional<Eigen::Vector2f> OpenPlace(Site& site, float room_m, float reach_m);

// Unit vector to the left.
inline Eigen::Vector2f Left(const Eigen::Vector2f& v) {
  return Eigen::Vector2f(-v.y(), v.x()).normalized();
}
inline Eigen::Vector3f Horizontal(const Eigen::Vector2f& v) { return {v.x(), v.y(), 0}; }

}  // namespace mono3d::synthetic
