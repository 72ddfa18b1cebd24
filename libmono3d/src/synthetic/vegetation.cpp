// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/vegetation.h"

#include <cmath>
#include <numbers>

namespace mono3d::synthetic {
namespace {

using Eigen::Vector3f;

Finish RandomLeaves(RandomNumbers& random) {
  const auto yellow = static_cast<float>(random.Uniform(0.7, 1.5));
  const auto bright = static_cast<float>(random.Uniform(0.75, 1.25));
  return {Material::kFoliage, bright * Vector3f(0.085F * yellow, 0.135F, 0.035F), random.Bits()};
}

void AddTrunk(Mesh& mesh, const PlantOptions& tree, float radius_m, RandomNumbers& random) {
  // It starts below the ground, so that slopes leave no gap.
  const Vector3f centre = tree.base + 0.15F * tree.height_m * Vector3f::UnitZ();
  AddBlock(mesh,
           CentredBlock(centre, 2 * radius_m * Vector3f::UnitX(), 2 * radius_m * Vector3f::UnitY(),
                        0.6F * tree.height_m * Vector3f::UnitZ()),
           {Material::kWood, Vector3f(0.16F, 0.12F, 0.09F), random.Bits()});
}

// An ellipsoid with a lumpy surface.
struct Crown {
  Vector3f centre;
  Vector3f radii_m;
  float lumpiness = 0.4F;  // of the radius
};

void AddCrown(Mesh& mesh, const Crown& crown, const Finish& leaves) {
  const FractalOptions lumps{0.9F, 0.2F, 0.7F, leaves.seed};
  const auto position = [&](float s, float t) {
    const float azimuth = 2 * std::numbers::pi_v<float> * s;
    const float polar = std::numbers::pi_v<float> * t;  // upwards, for outward triangles
    const Vector3f direction(std::sin(polar) * std::cos(azimuth),
                             std::sin(polar) * std::sin(azimuth), -std::cos(polar));
    const float radius = 1 + crown.lumpiness * FractalNoise(direction, lumps, 0);
    return Vector3f(crown.centre + radius * direction.cwiseProduct(crown.radii_m));
  };
  AddSheet(mesh, {36, 20}, position, leaves);
}

}  // namespace

void AddBroadleafTree(Mesh& mesh, const PlantOptions& tree, RandomNumbers& random) {
  AddTrunk(mesh, tree, 0.03F * tree.height_m, random);
  const Finish leaves = RandomLeaves(random);
  const int num_crowns = 2 + static_cast<int>(random.Uniform(0, 2.99));
  for (int i = 0; i < num_crowns; ++i) {
    const float h = tree.height_m;
    const Vector3f centre(static_cast<float>(random.Uniform(-0.14, 0.14)) * h,
                          static_cast<float>(random.Uniform(-0.14, 0.14)) * h,
                          static_cast<float>(random.Uniform(0.52, 0.72)) * h);
    const float radius_m = static_cast<float>(random.Uniform(0.2, 0.29)) * h;
    AddCrown(mesh, {tree.base + centre, Vector3f(radius_m, radius_m, 1.05F * radius_m)}, leaves);
  }
}

void AddConifer(Mesh& mesh, const PlantOptions& tree, RandomNumbers& random) {
  AddTrunk(mesh, tree, 0.02F * tree.height_m, random);
  const Finish needles{Material::kFoliage, Vector3f(0.045F, 0.085F, 0.04F), random.Bits()};
  constexpr float kNumTiers = 6;
  const float radius_m = 0.19F * tree.height_m;
  const auto position = [&](float s, float t) {
    const float azimuth = 2 * std::numbers::pi_v<float> * s;
    const Vector3f direction(std::cos(azimuth), std::sin(azimuth), 0);
    const float tier = kNumTiers * t - std::floor(kNumTiers * t);
    const float ragged = 0.35F * FractalNoise(Vector3f(3 * direction + 9 * t * Vector3f::UnitZ()),
                                              {1, 0.4F, 0.7F, needles.seed}, 0);
    const float radius = radius_m * (1 - t) * (1.1F - 0.4F * tier + ragged);
    return Vector3f(tree.base + radius * direction +
                    tree.height_m * (0.12F + 0.88F * t) * Vector3f::UnitZ());
  };
  AddSheet(mesh, {28, 24}, position, needles);
}

void AddBush(Mesh& mesh, const PlantOptions& bush, RandomNumbers& random) {
  const float radius_m = bush.height_m / 1.6F;
  AddCrown(mesh,
           {bush.base + 0.35F * bush.height_m * Vector3f::UnitZ(),
            Vector3f(radius_m, radius_m, 0.65F * bush.height_m)},
           RandomLeaves(random));
}

}  // namespace mono3d::synthetic
