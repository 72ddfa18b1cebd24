// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <string>

#include "mono3d/core/options.h"
#include "synthetic/scene.h"

namespace mono3d::synthetic {

// What a scene can be: the middle of interest is near the origin in each.
//   village    houses with gardens along winding streets on hilly ground
//   town       straight streets, blocks of row houses with repeating roofs and windows
//   mansion    one large house with wings, in a park
//   church     a nave and a tower, amid a churchyard
//   warehouse  a large hall with bare walls and a flat roof, on a yard
//   fields     flat farmland with little structure, a few trees, a street
//   hills      high relief, meadows, paths and woods, a few houses
inline constexpr std::array<const char*, 7> kSceneKinds = {
    "village", "town", "mansion", "church", "warehouse", "fields", "hills"};

struct SceneOptions {
  std::string kind = "village";  // one of kSceneKinds
  int seed = 1;                  // one scene for each
  double half_extent_m = 190;    // of the square of terrain around the origin
  double relief_m = -1;          // how far hills are from the mean height; -1: as the kind has it
  bool with_water = false;       // a river or a pond
  bool with_wires = false;       // poles with wires, street lamps, fences
  bool with_glass = false;       // panes mirror the sky and what stands opposite
  int num_moving_cars = 0;       // that drive along the streets
  LightOptions light;

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

// The same options give the same scene, on each machine.
Scene BuildScene(const SceneOptions& options = {});

// Height of the ground in metres at a place of the horizontal plane: without houses and plants.
// Beyond the terrain: as on its rim.
float GroundHeight(const Scene& scene, const Eigen::Vector2f& p_m);

}  // namespace mono3d::synthetic
