// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "synthetic/ground_map.h"

namespace mono3d::synthetic {

enum class Material {
  kTestPattern,  // coloured noise with the same contrast at every scale
  kGround,       // meadow, fields, streets and paths, as the ground map says
  kPlaster,
  kStone,
  kRoofTiles,
  kGravel,
  kGlass,        // matt: what is behind the pane
  kMirrorGlass,  // mirrors, the more the flatter one looks at it
  kWater,        // mirrors, with ripples that stand still
  kBareWall,     // hardly any texture
  kAsphalt,
  kWood,
  kPaint,
  kFoliage,
  kSoil,
};

// A piece of the scene with one texture.
struct Surface {
  Material material = Material::kTestPattern;
  Eigen::Vector3f colour =
      Eigen::Vector3f::Constant(0.5F);               // mean albedo: red, green, blue, linear
  Eigen::Vector3f origin = Eigen::Vector3f::Zero();  // of the texture's (u, v), in the world
  Eigen::Vector3f u_axis = Eigen::Vector3f::UnitX();
  Eigen::Vector3f v_axis = Eigen::Vector3f::UnitY();
  std::uint32_t seed = 0;
  bool is_smooth = false;  // shaded with the vertices' normals
};

// Share of light that comes from the mirrored direction, for a ray that makes an angle of this
// cosine with the surface's normal.
float Reflectance(Material material, float cosine);

// Slope of the ripples on water, along the world's x and y.
Eigen::Vector2f RippleSlope(const Surface& surface, const Eigen::Vector2f& p_m, float footprint_m);

// Albedo (red, green, blue, linear, 0 to 1) of the surface at a place that a pixel sees with the
// given footprint. Free of detail finer than the footprint. `ground` may be null unless the
// material is kGround.
Eigen::Vector3f Albedo(const Surface& surface, const GroundMap* ground,
                       const Eigen::Vector3f& p_world, float footprint_m);

}  // namespace mono3d::synthetic
