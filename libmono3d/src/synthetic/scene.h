// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>

#include "synthetic/ground_map.h"
#include "synthetic/mesh.h"

namespace mono3d::synthetic {

struct Ray {
  Eigen::Vector3f origin;     // world, metres
  Eigen::Vector3f direction;  // of any length but zero
};

// Where a ray meets the scene first.
struct Hit {
  float distance = 0;      // in lengths of the ray's direction
  Eigen::Vector3f p;       // world
  Eigen::Vector3f normal;  // unit length, of the shaded surface, towards the ray's origin
  const Surface* surface = nullptr;
};

// Surfaces in the world (metres, z up) that rays can be shot at. Thread-safe once built.
class Scene {
 public:
  // Throws Error when Embree cannot build it.
  explicit Scene(Mesh mesh, GroundMap ground = {});
  ~Scene();
  Scene(Scene&&) noexcept;
  Scene& operator=(Scene&&) noexcept;

  std::optional<Hit> Intersect(const Ray& ray) const;
  bool IsOccluded(const Ray& ray) const;  // anything between 0 and infinity

  const Mesh& mesh() const;
  const GroundMap& ground() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mono3d::synthetic
