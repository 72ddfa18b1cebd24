// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/terrain.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "synthetic/noise.h"

namespace mono3d::synthetic {
namespace {

constexpr double kMeshCell_m = 1;
constexpr int kMaxMeshCells = 480;  // along a side: larger terrain has larger cells
// Around the square each cell is larger than the one before: 45 of them reach 3.6 km.
constexpr int kOuterCells = 45;
constexpr float kOuterGrowth = 1.15F;
constexpr float kBank_m = 35;      // over which ground goes down to the water
constexpr float kLevelBank_m = 6;  // beside the water
constexpr float kBed_m = 1.6F;
constexpr float kShore_m = 0.7F;  // of the ground's edge above the water

float ClampedSmoothStep(float t) {
  t = std::clamp(t, 0.0F, 1.0F);
  return t * t * (3 - 2 * t);
}

// Where the vertices of a row of the sheet lie, from its middle.
std::vector<float> Lattice(double half_extent_m) {
  const int num_cells =
      std::min(static_cast<int>(std::ceil(2 * half_extent_m / kMeshCell_m)), kMaxMeshCells);
  const auto extent_m = static_cast<float>(half_extent_m);
  const float cell_m = 2 * extent_m / static_cast<float>(num_cells);
  std::vector<float> outer_m;
  float step_m = cell_m;
  float place_m = extent_m;
  for (int i = 0; i < kOuterCells; ++i) {
    step_m *= kOuterGrowth;
    place_m += step_m;
    outer_m.push_back(place_m);
  }
  std::vector<float> places_m;
  for (auto it = outer_m.rbegin(); it != outer_m.rend(); ++it) places_m.push_back(-*it);
  for (int i = 0; i <= num_cells; ++i) {
    places_m.push_back(static_cast<float>(i) * cell_m - extent_m);
  }
  places_m.insert(places_m.end(), outer_m.begin(), outer_m.end());
  return places_m;
}

}  // namespace

Terrain::Terrain(const TerrainOptions& options, const GroundMap& ground)
    : options_(options), ground_(ground) {}

float Terrain::NaturalHeightAt(const Eigen::Vector2f& p_m) const {
  // Hills of some 100 m, which streets and houses follow; banks and bumps only away from them.
  const float hills = FractalNoise(p_m, {130, 60, 0.35F, options_.seed}, 0);
  const float from_street_m = ground_.streets.At(p_m) - kStreetHalfWidth_m - kPavementWidth_m;
  const float rough_share = std::clamp(from_street_m / 12, 0.0F, 1.0F);
  const float bumps = FractalNoise(p_m, {14, 2, 0.5F, options_.seed + 40}, 0);
  return 1.6F * static_cast<float>(options_.relief_m) * hills +
         rough_share * static_cast<float>(options_.bumps_m) * bumps;
}

float Terrain::HeightAt(const Eigen::Vector2f& p_m) const {
  float height_m = NaturalHeightAt(p_m);
  if (options_.flat_radius_m > 0) {
    const auto radius_m = static_cast<float>(options_.flat_radius_m);
    height_m *= ClampedSmoothStep((p_m.norm() - radius_m) / radius_m);
  }
  if (ground_.water.IsEmpty()) return height_m;
  const float from_shore_m = ground_.water.At(p_m) - ground_.water_half_width_m;
  const float bank = ClampedSmoothStep((from_shore_m - kLevelBank_m) / kBank_m);
  const float shore_m = ground_.water_level_m - kBed_m +
                        (kBed_m + kShore_m) * ClampedSmoothStep(from_shore_m / 3 + 1);
  return shore_m + bank * (height_m - shore_m);
}

void Terrain::AddTo(Mesh& mesh) const {
  const std::vector<float> places_m = Lattice(options_.half_extent_m);
  const int num_cells = static_cast<int>(places_m.size()) - 1;
  const auto place = [&](float share) {
    return places_m[static_cast<std::size_t>(std::lround(share * static_cast<float>(num_cells)))];
  };
  AddSheet(mesh, {num_cells, num_cells},
           [&](float s, float t) { return At(Eigen::Vector2f(place(s), place(t))); },
           {Material::kGround, Eigen::Vector3f::Constant(0.2F), options_.seed});
}

}  // namespace mono3d::synthetic
