// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "synthetic/ground_map.h"
#include "synthetic/light.h"
#include "synthetic/mesh.h"

namespace mono3d::synthetic {

struct Ray {
  Eigen::Vector3f origin;     // world, metres
  Eigen::Vector3f direction;  // of any length but zero
  // Where moving objects stand, within the scene's time span; beyond it as at its nearer end.
  float time_s = 0;
};

// Where a ray meets the scene first.
struct Hit {
  float distance = 0;         // in lengths of the ray's direction
  Eigen::Vector3f p;          // world
  Eigen::Vector3f p_surface;  // the same in the frame of the surface's texture
  Eigen::Vector3f normal;     // unit length, of the shaded surface, towards the ray's origin
  const Surface* surface = nullptr;
  bool is_moving = false;         // part of a moving object
  std::optional<bool> is_sunlit;  // unset: not yet found out; Intersect leaves it unset
};

// A rigid object that goes its own way, a car for example.
struct MovingObject {
  Mesh mesh;  // in the object's own frame
  std::function<Eigen::Isometry3f(double t_s)> T_world_object;
};

// Surfaces in the world (metres, z up) that rays can be shot at. Shooting rays is thread-safe;
// changing time or light is not.
class Scene {
 public:
  // Throws Error when Embree cannot build it.
  explicit Scene(Mesh mesh, GroundMap ground = {}, std::vector<MovingObject> moving = {});
  ~Scene();
  Scene(Scene&&) noexcept;
  Scene& operator=(Scene&&) noexcept;

  // Places the moving objects for rays of begin_s to end_s, seconds: while a shutter is open, a
  // fraction of a second, in which they go straight on (one that is 50 m away at
  // the end has jumped, and stays until then). Cheap; nothing to do in a scene that stands
  // still. A new scene is at time 0. Throws Error when the span is not finite or ends before it
  // begins.
  void SetTimeSpan(double begin_s, double end_s);

  std::optional<Hit> Intersect(const Ray& ray) const;
  bool IsOccluded(const Ray& ray) const;  // anything between 0 and infinity
  // The same for many rays, in packets: faster when neighbours go much the same way. Throws Error
  // unless both lists have the same length.
  void Intersect(std::span<const Ray> rays, std::span<std::optional<Hit>> hits) const;
  void AreOccluded(std::span<const Ray> rays, std::span<char> occluded) const;  // 0 or 1

  const Mesh& mesh() const;  // what stands still
  const GroundMap& ground() const;
  bool HasMovingObjects() const;
  const Light& light() const;
  void set_light(const Light& light);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mono3d::synthetic
