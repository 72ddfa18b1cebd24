// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/scene_builder.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include "mono3d/core/error.h"
#include "synthetic/car.h"
#include "synthetic/country.h"
#include "synthetic/furniture.h"
#include "synthetic/landmark.h"
#include "synthetic/town.h"
#include "synthetic/village.h"
#include "synthetic/water.h"

namespace mono3d::synthetic {

namespace {

// What lies and stands in a scene of one kind. The ground is laid by `add`.
struct SceneKind {
  const char* name;
  double relief_m;
  bool has_pond;                                         // rather than a river
  float water_y_m;                                       // of the river's or pond's middle
  std::function<std::function<void(Site&)>(Site&)> lay;  // returns `add`
};

std::function<void(Site&)> LayLandmarkKind(Site& site, Landmark landmark) {
  return [landmark, houses = LayLandmark(site, landmark)](Site& then) {
    AddLandmark(then, landmark, houses);
  };
}

const std::vector<SceneKind>& Kinds() {
  using Add = std::function<void(Site&)>;
  static const std::vector<SceneKind> kinds = {
      {"village", 9, false, -82,
       [](Site& site) -> Add {
         return [plan = LayVillage(site)](Site& then) { AddVillage(then, plan, {}); };
       }},
      {"town", 2, false, -50,
       [](Site& site) -> Add {
         return [plan = LayTown(site)](Site& then) { AddTown(then, plan); };
       }},
      {"mansion", 6, true, -62,
       [](Site& site) { return LayLandmarkKind(site, Landmark::kMansion); }},
      {"church", 5, true, 62, [](Site& site) { return LayLandmarkKind(site, Landmark::kChurch); }},
      {"warehouse", 2, true, 68,
       [](Site& site) { return LayLandmarkKind(site, Landmark::kWarehouse); }},
      {"fields", 1, false, -60,
       [](Site& site) -> Add {
         return [houses = LayFields(site)](Site& then) { AddFields(then, houses); };
       }},
      {"hills", 26, false, -70,
       [](Site& site) -> Add {
         return [houses = LayHills(site)](Site& then) { AddHills(then, houses); };
       }},
  };
  return kinds;
}

const SceneKind* FindKind(const std::string& name) {
  const auto& kinds = Kinds();
  const auto it =
      std::find_if(kinds.begin(), kinds.end(), [&](const SceneKind& k) { return k.name == name; });
  return it == kinds.end() ? nullptr : &*it;
}

void AddFurniture(Site& site) {
  for (const Polyline& street : site.routes) {
    AddPolesWithWires(site, street);
    AddStreetLamps(site, street);
    AddFences(site, street);
  }
}

// Glass that mirrors, in the place of matt glass.
void Polish(Mesh& mesh) {
  for (Surface& surface : mesh.surfaces) {
    if (surface.material == Material::kGlass) surface.material = Material::kMirrorGlass;
  }
}

}  // namespace

void SceneOptions::Visit(OptionVisitor& visit) {
  visit("kind", kind, "village, town, mansion, church, warehouse, fields or hills");
  visit("seed", seed, "one scene for each");
  visit("half_extent_m", half_extent_m, "half side of the terrain, metres");
  visit("relief_m", relief_m, "height of the hills, metres; -1: as the kind has it");
  visit("with_water", with_water, "a river or a pond");
  visit("with_wires", with_wires, "poles with wires, street lamps, fences");
  visit("with_glass", with_glass, "panes mirror the sky and what stands opposite");
  visit("num_moving_cars", num_moving_cars, "cars that drive along the streets");
  visit.Group("light", light);
}

void SceneOptions::Validate() const {
  if (FindKind(kind) == nullptr) {
    std::string names;
    for (const char* name : kSceneKinds) names += (names.empty() ? "" : ", ") + std::string(name);
    throw UsageError("--scene.kind: expected one of " + names + "; found " + kind);
  }
  RequireOption(half_extent_m >= 50 && half_extent_m <= 1000, "half_extent_m", "50 to 1000",
                half_extent_m);
  RequireOption(relief_m == -1 || (relief_m >= 0 && relief_m <= 100), "relief_m", "0 to 100, or -1",
                relief_m);
  RequireOption(num_moving_cars >= 0 && num_moving_cars <= 1000, "num_moving_cars", "0 to 1000",
                num_moving_cars);
  light.Validate();
}

Scene BuildScene(const SceneOptions& options) {
  options.Validate();
  const SceneKind& kind = *FindKind(options.kind);
  Site site(static_cast<std::uint32_t>(options.seed));
  site.terrain.half_extent_m = options.half_extent_m;
  site.terrain.relief_m = options.relief_m < 0 ? kind.relief_m : options.relief_m;
  site.terrain.seed = site.ground.seed;
  std::optional<WaterOptions> water;
  if (options.with_water) {
    water = kind.has_pond ? Pond({28, kind.water_y_m}) : River(site, kind.water_y_m);
    LayWater(site, *water);
  }
  const std::function<void(Site&)> add = kind.lay(site);
  add(site);
  if (water) AddWater(site, *water);
  if (options.with_wires) AddFurniture(site);
  AddDrivingCars(site, options.num_moving_cars);
  if (options.with_glass) {
    Polish(site.mesh);
    for (MovingObject& object : site.moving) Polish(object.mesh);
  }
  Scene scene(std::move(site.mesh), std::move(site.ground), std::move(site.moving));
  scene.set_light(MakeLight(options.light));
  return scene;
}

float GroundHeight(const Scene& scene, const Eigen::Vector2f& p_m) {
  return scene.ground().heights.IsEmpty() ? 0 : scene.ground().heights.At(p_m);
}

}  // namespace mono3d::synthetic
