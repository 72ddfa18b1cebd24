// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/building.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "synthetic/facade.h"

namespace mono3d::synthetic {

namespace {

using Eigen::Vector3f;

constexpr float kParapet_m = 0.7F;
constexpr float kParapetThickness_m = 0.35F;

void AddWindows(Mesh& mesh, const Wall& wall, const BuildingOptions& building,
                RandomNumbers& random) {
  const int num_columns = static_cast<int>(wall.length_m / 3);
  const float spacing_m = wall.length_m / static_cast<float>(std::max(num_columns, 1));
  for (int storey = 0; storey < building.num_storeys; ++storey) {
    for (int column = 0; column < num_columns; ++column) {
      const float along_m = (static_cast<float>(column) + 0.5F) * spacing_m;
      const float height_m = static_cast<float>(storey) * kStorey_m + 1.6F;
      AddWindow(mesh, wall, {along_m, height_m, 1.4F, 1.4F}, random);
    }
  }
}

// Stairs, lifts and machines.
void AddRoofBoxes(Mesh& mesh, const BuildingOptions& building, const Vector3f& x, const Vector3f& y,
                  RandomNumbers& random) {
  const float top_m = static_cast<float>(building.num_storeys) * kStorey_m;
  const int num_boxes = 2 + static_cast<int>(building.length_m / 12);
  for (int i = 0; i < num_boxes; ++i) {
    const auto along = static_cast<float>(random.Uniform(-0.4, 0.4)) * building.length_m;
    const auto across = static_cast<float>(random.Uniform(-0.35, 0.35)) * building.width_m;
    const auto height_m = static_cast<float>(random.Uniform(0.6, 2.2));
    const auto size_m = static_cast<float>(random.Uniform(0.8, 2.6));
    AddBlock(mesh,
             CentredBlock(building.base + along * x + across * y +
                              (top_m + height_m / 2) * Vector3f::UnitZ(),
                          size_m * x, 0.8F * size_m * y, height_m * Vector3f::UnitZ()),
             {Material::kGravel, Vector3f::Constant(0.38F), random.Bits()});
  }
}

}  // namespace

void AddBuilding(Mesh& mesh, const BuildingOptions& building, RandomNumbers& random) {
  const Vector3f x(std::cos(building.yaw_rad), std::sin(building.yaw_rad), 0);
  const Vector3f y(-x.y(), x.x(), 0);
  const Vector3f z = Vector3f::UnitZ();
  const float hx = building.length_m / 2;
  const float hy = building.width_m / 2;
  const float top_m = static_cast<float>(building.num_storeys) * kStorey_m;
  const Vector3f& base = building.base;
  const std::array<Wall, 4> walls = {{{base - hx * x - hy * y, x, -y, building.length_m},
                                      {base + hx * x - hy * y, y, x, building.width_m},
                                      {base + hx * x + hy * y, -x, y, building.length_m},
                                      {base - hx * x + hy * y, -y, -x, building.width_m}}};
  for (const Wall& wall : walls) {
    AddParallelogram(
        mesh,
        {wall.corner - kFoundation_m * z, wall.length_m * wall.along, (top_m + kFoundation_m) * z},
        building.wall);
    // Each parapet ends where the next begins.
    AddBlock(mesh,
             {wall.corner + top_m * z, (wall.length_m - kParapetThickness_m) * wall.along,
              -kParapetThickness_m * wall.outwards, kParapet_m * z},
             building.wall);
    if (building.has_windows) AddWindows(mesh, wall, building, random);
  }
  AddParallelogram(mesh, {walls[0].corner + top_m * z, building.length_m * x, building.width_m * y},
                   building.roof);
  AddRoofBoxes(mesh, building, x, y, random);
}

}  // namespace mono3d::synthetic
