// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/house.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "synthetic/facade.h"

namespace mono3d::synthetic {
namespace {

using Eigen::Vector3f;

constexpr float kOverhang_m = 0.55F;
constexpr float kRoofThickness_m = 0.18F;

// The house's own axes in the world.
struct Axes {
  Vector3f base;
  Vector3f x;
  Vector3f y;
  Vector3f z = Vector3f::UnitZ();

  Vector3f At(float px, float py, float pz) const { return base + px * x + py * y + pz * z; }
};

std::array<Wall, 4> WallsOf(const Axes& axes, const HouseOptions& house) {
  const float hx = house.length_m / 2;
  const float hy = house.width_m / 2;
  return {{{axes.At(-hx, -hy, 0), axes.x, -axes.y, house.length_m},
           {axes.At(hx, -hy, 0), axes.y, axes.x, house.width_m},
           {axes.At(hx, hy, 0), -axes.x, axes.y, house.length_m},
           {axes.At(-hx, hy, 0), -axes.y, -axes.x, house.width_m}}};
}

void AddWindowsAndDoor(Mesh& mesh, const Wall& wall, const HouseOptions& house, bool has_door,
                       const Finish& shutter, RandomNumbers& random) {
  const int num_columns = static_cast<int>(wall.length_m / 3.1F);
  const float spacing_m = wall.length_m / static_cast<float>(num_columns);
  for (int storey = 0; storey < house.num_storeys; ++storey) {
    for (int column = 0; column < num_columns; ++column) {
      const float along_m = (static_cast<float>(column) + 0.5F) * spacing_m;
      const float floor_m = static_cast<float>(storey) * kStorey_m;
      if (has_door && storey == 0 && column == num_columns / 2) {
        AddSlab(mesh, wall, {along_m, 1.05F, 1.3F, 2.2F}, 0.06F,
                {Material::kPaint, Vector3f(0.5F, 0.48F, 0.44F), 0});
        AddSlab(mesh, wall, {along_m, 1.02F, 1.0F, 2.05F}, 0.09F,
                {Material::kWood, shutter.colour, random.Bits()});
      } else if (random.Chance(house.window_share)) {
        AddWindow(mesh, wall, {along_m, floor_m + 1.6F, 1.0F, 1.3F}, random);
        if (random.Chance(house.shutter_share)) {
          AddShutters(mesh, wall, {along_m, floor_m + 1.6F, 1.0F, 1.3F}, shutter);
        }
      }
    }
  }
}

// One side of the roof; `side` is -1 or 1 along y.
void AddRoofSide(Mesh& mesh, const Axes& axes, const HouseOptions& house, float side) {
  const float hx = house.length_m / 2 + house.gable_overhang_m;
  const float run = house.width_m / 2 + kOverhang_m;
  const float eave = static_cast<float>(house.num_storeys) * kStorey_m;
  const float ridge = eave + house.roof_slope * house.width_m / 2;
  const Vector3f eave_edge = axes.At(side * hx, side * run, ridge - house.roof_slope * run);
  const Vector3f up_slope = axes.At(side * hx, 0, ridge) - eave_edge;
  const Vector3f along = -side * 2 * hx * axes.x;  // with up_slope and off the roof right-handed
  const Vector3f thickness = kRoofThickness_m * along.cross(up_slope).normalized();
  AddBlock(mesh, {eave_edge, along, up_slope, thickness}, house.roof);
}

void AddGables(Mesh& mesh, const Axes& axes, const HouseOptions& house) {
  const float hx = house.length_m / 2;
  const float hy = house.width_m / 2;
  const float eave = static_cast<float>(house.num_storeys) * kStorey_m;
  const float ridge = eave + house.roof_slope * hy;
  AddTriangle(mesh, {axes.At(hx, -hy, eave), axes.At(hx, hy, eave), axes.At(hx, 0, ridge)},
              house.wall);
  AddTriangle(mesh, {axes.At(-hx, hy, eave), axes.At(-hx, -hy, eave), axes.At(-hx, 0, ridge)},
              house.wall);
}

void AddChimney(Mesh& mesh, const Axes& axes, const HouseOptions& house, RandomNumbers& random) {
  const float eave = static_cast<float>(house.num_storeys) * kStorey_m;
  const float ridge = eave + house.roof_slope * house.width_m / 2;
  const auto px = static_cast<float>(random.Uniform(-0.35, 0.35)) * house.length_m;
  const auto py = static_cast<float>(random.Uniform(-0.2, 0.2)) * house.width_m;
  const Finish stone{Material::kStone, Vector3f(0.34F, 0.22F, 0.17F), random.Bits()};
  AddBlock(mesh,
           CentredBlock(axes.At(px, py, ridge - 0.4F), 0.8F * axes.x, 0.7F * axes.y, 3 * axes.z),
           stone);
  AddBlock(
      mesh,
      CentredBlock(axes.At(px, py, ridge + 1.15F), 1.05F * axes.x, 0.95F * axes.y, 0.15F * axes.z),
      {Material::kGravel, Vector3f::Constant(0.3F), random.Bits()});
}

// Roof windows or solar panels: slabs on the side of the roof that faces -y.
void AddRoofPanels(Mesh& mesh, const Axes& axes, const HouseOptions& house, RandomNumbers& random) {
  const Vector3f up_slope = (axes.y + house.roof_slope * axes.z).normalized();
  const Vector3f off = axes.x.cross(up_slope);
  const float eave = static_cast<float>(house.num_storeys) * kStorey_m;
  const Vector3f middle =
      axes.At(0, -house.width_m / 4, eave + house.roof_slope * house.width_m / 4);
  const int num_panels = static_cast<int>(random.Uniform(2, 6));
  const Finish glass{Material::kGlass, Vector3f(0.04F, 0.055F, 0.1F), random.Bits()};
  const Finish frame{Material::kPaint, Vector3f::Constant(0.45F), 0};
  for (int i = 0; i < num_panels; ++i) {
    const float place = (static_cast<float>(i) - static_cast<float>(num_panels - 1) / 2) * 1.35F;
    const Vector3f centre = middle + place * axes.x + 0.2F * off;
    AddBlock(mesh, CentredBlock(centre, 1.25F * axes.x, 1.9F * up_slope, 0.12F * off), frame);
    AddBlock(mesh, CentredBlock(centre + 0.02F * off, 1.1F * axes.x, 1.75F * up_slope, 0.12F * off),
             glass);
  }
}

}  // namespace

void AddHouse(Mesh& mesh, const HouseOptions& house, RandomNumbers& random) {
  const Vector3f x(std::cos(house.yaw_rad), std::sin(house.yaw_rad), 0);
  const Axes axes{house.base, x, Vector3f(-x.y(), x.x(), 0)};
  const float eave = static_cast<float>(house.num_storeys) * kStorey_m;
  static constexpr std::array<std::array<float, 3>, 4> kPaints = {
      {{0.1F, 0.2F, 0.12F}, {0.28F, 0.08F, 0.06F}, {0.12F, 0.16F, 0.26F}, {0.25F, 0.16F, 0.09F}}};
  const auto& paint = kPaints[random.Bits() % kPaints.size()];
  const Finish shutter{Material::kWood, Vector3f(paint[0], paint[1], paint[2]), random.Bits()};
  int index = 0;
  for (const Wall& wall : WallsOf(axes, house)) {
    AddParallelogram(mesh,
                     {wall.corner - kFoundation_m * axes.z, wall.length_m * wall.along,
                      (eave + kFoundation_m) * axes.z},
                     house.wall);
    if (house.has_gable_windows || index % 2 == 0) {
      AddWindowsAndDoor(mesh, wall, house, index == 0, shutter, random);
    }
    ++index;
  }
  AddGables(mesh, axes, house);
  AddRoofSide(mesh, axes, house, -1);
  AddRoofSide(mesh, axes, house, 1);
  AddChimney(mesh, axes, house, random);
  if (random.Chance(house.panel_share)) AddRoofPanels(mesh, axes, house, random);
}

HouseOptions RandomHouse(RandomNumbers& random) {
  static constexpr std::array<std::array<float, 3>, 6> kWalls = {{{0.6F, 0.56F, 0.48F},
                                                                  {0.55F, 0.45F, 0.3F},
                                                                  {0.62F, 0.6F, 0.57F},
                                                                  {0.5F, 0.36F, 0.27F},
                                                                  {0.42F, 0.46F, 0.47F},
                                                                  {0.45F, 0.41F, 0.35F}}};
  static constexpr std::array<std::array<float, 3>, 4> kRoofs = {
      {{0.34F, 0.13F, 0.08F}, {0.27F, 0.13F, 0.09F}, {0.2F, 0.15F, 0.13F}, {0.14F, 0.145F, 0.16F}}};
  HouseOptions house;
  house.length_m = static_cast<float>(random.Uniform(9.5, 14));
  house.width_m = static_cast<float>(random.Uniform(7, 9.5));
  house.num_storeys = random.Chance(0.45) ? 1 : 2;
  house.roof_slope = static_cast<float>(random.Uniform(0.6, 1.05));
  const auto& wall = kWalls[random.Bits() % kWalls.size()];
  const auto& roof = kRoofs[random.Bits() % kRoofs.size()];
  house.wall = {random.Chance(0.35) ? Material::kStone : Material::kPlaster,
                Vector3f(wall[0], wall[1], wall[2]), random.Bits()};
  house.roof = {Material::kRoofTiles, Vector3f(roof[0], roof[1], roof[2]), random.Bits()};
  return house;
}

}  // namespace mono3d::synthetic
