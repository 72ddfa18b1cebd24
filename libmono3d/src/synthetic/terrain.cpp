// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/terrain.h"

#include <algorithm>
#include <cmath>

#include "synthetic/noise.h"

namespace mono3d::synthetic {
namespace {

constexpr float kMeshCell_m = 1;

}  // namespace

Terrain::Terrain(const TerrainOptions& options, const GroundMap& ground)
    : options_(options), ground_(ground) {}

float Terrain::HeightAt(const Eigen::Vector2f& p_m) const {
  // Hills of some 100 m, which streets and houses follow; banks and bumps only away from them.
  const float hills = FractalNoise(p_m, {130, 60, 0.35F, options_.seed}, 0);
  const float from_street_m = ground_.streets.At(p_m) - kStreetHalfWidth_m - kPavementWidth_m;
  const float rough_share = std::clamp(from_street_m / 12, 0.0F, 1.0F);
  const float bumps = FractalNoise(p_m, {14, 2, 0.5F, options_.seed + 40}, 0);
  return 1.6F * static_cast<float>(options_.relief_m) * hills + rough_share * bumps;
}

void Terrain::AddTo(Mesh& mesh) const {
  const auto side_m = static_cast<float>(2 * options_.half_extent_m);
  const int num_cells = static_cast<int>(std::ceil(side_m / kMeshCell_m));
  const auto position = [&](float s, float t) {
    return At(Eigen::Vector2f((s - 0.5F) * side_m, (t - 0.5F) * side_m));
  };
  AddSheet(mesh, {num_cells, num_cells}, position,
           {Material::kGround, Eigen::Vector3f::Constant(0.2F), options_.seed});
}

}  // namespace mono3d::synthetic
