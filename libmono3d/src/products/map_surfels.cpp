// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/products/map_surfels.h"

#include <algorithm>
#include <cmath>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

constexpr std::size_t kSurfelsPerBlock = std::size_t{1} << 16;
// What quantiles are taken of: each so many-th.
constexpr std::size_t kSampleStep = 16;

float MedianOf(std::vector<float>& values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// From the least value to the largest but for one of two thousand on each side.
Eigen::Vector2d RangeOfMost(std::vector<float> values) {
  std::ranges::sort(values);
  const std::size_t left_out = values.size() / 2000;
  return {values[left_out], values[values.size() - 1 - left_out]};
}

// All that is drawn or written of a surfel.
void RequireFinite(const MapSurfelBlock& surfels, const std::filesystem::path& model) {
  const auto refuse = [&](const char* what) {
    throw Error(ErrorParts{
        .what = what, .where = model.string(), .expected = "finite numbers", .found = "others"});
  };
  const auto is_finite = [](const auto& v) { return v.allFinite(); };
  const auto is_number = [](float number) { return std::isfinite(number); };
  if (!std::ranges::all_of(surfels.points, is_finite)) refuse("surfels without a place");
  if (!std::ranges::all_of(surfels.normals, is_finite)) refuse("surfels without a direction");
  if (!std::ranges::all_of(surfels.cloud.radii, is_number)) refuse("surfels without a radius");
  if (!std::ranges::all_of(surfels.cloud.confidences, is_number)) {
    refuse("surfels without a confidence");
  }
}

}  // namespace

MapSurfels::MapSurfels(const std::filesystem::path& model, const MapAxes& axes)
    : axes_(axes), reader_(model) {
  if (reader_.size() == 0) {
    throw Error(ErrorParts{.what = "the model is empty",
                           .where = model.string(),
                           .expected = "surfels",
                           .found = "none"});
  }
  bounds_of_blocks_.resize((reader_.size() + kSurfelsPerBlock - 1) / kSurfelsPerBlock);
  max_radii_.resize(num_blocks(), 0);
  std::vector<float> radii;
  std::vector<Eigen::Vector2d> sample;
  MapSurfelBlock surfels;
  for (std::size_t block = 0; block < num_blocks(); ++block) {
    Read(block, surfels);
    RequireFinite(surfels, model);
    for (const float radius : surfels.cloud.radii) {
      max_radii_[block] = std::max<double>(max_radii_[block], radius);
    }
    for (std::size_t i = 0; i < surfels.points.size(); ++i) {
      bounds_of_blocks_[block].extend(surfels.points[i]);
      if (i % kSampleStep != 0) continue;
      sample.emplace_back(surfels.points[i].head<2>());
      if (!surfels.cloud.radii.empty()) radii.push_back(surfels.cloud.radii[i]);
    }
    bounds_.extend(bounds_of_blocks_[block]);
  }
  median_radius_ = MedianOf(radii);
  for (const Eigen::Vector2d& place : sample) {
    sample_x_.push_back(static_cast<float>(place.x() - bounds_.min().x()));
    sample_y_.push_back(static_cast<float>(place.y() - bounds_.min().y()));
  }
}

Eigen::AlignedBox2d MapSurfels::BoundsOfMost() const {
  const Eigen::Vector2d x = RangeOfMost(sample_x_), y = RangeOfMost(sample_y_);
  const Eigen::Vector2d least = bounds_.min().head<2>();
  return {least + Eigen::Vector2d(x[0], y[0]), least + Eigen::Vector2d(x[1], y[1])};
}

void MapSurfels::Read(std::size_t block, MapSurfelBlock& surfels) {
  reader_.Seek(block * kSurfelsPerBlock);
  const std::size_t count = reader_.Read(kSurfelsPerBlock, surfels.cloud);
  const bool has_normals = !surfels.cloud.normals.empty();
  surfels.points.resize(count);
  surfels.normals.resize(has_normals ? count : 0);
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d p_model = surfels.cloud.points[i].cast<double>();
    const AffineMap& map = MapNear(p_model);
    surfels.points[i] = map(p_model);
    if (!has_normals) continue;
    // A plane goes with the inverse transposed; the map is nearly a rotation of equal scales.
    const Eigen::Vector3d normal =
        map.linear.transpose().inverse() * surfels.cloud.normals[i].cast<double>();
    surfels.normals[i] = normal.normalized().cast<float>();
  }
}

const AffineMap& MapSurfels::MapNear(const Eigen::Vector3d& p_model) {
  if (axes_.system() == nullptr || !p_model.allFinite()) {
    static const AffineMap kSame;
    return kSame;
  }
  const Eigen::Vector3d cell = (p_model / MapAxes::kCell).array().floor();
  std::uint64_t key = 0;
  for (int k = 0; k < 3; ++k) {
    constexpr int kBits = 21;  // of each coordinate: 2^20 cells on either side of the origin
    const auto index = static_cast<std::int64_t>(std::clamp(cell[k], -1e6, 1e6));
    key = (key << kBits) | (static_cast<std::uint64_t>(index) & ((1U << kBits) - 1));
  }
  const auto known = maps_.find(key);
  if (known != maps_.end()) return known->second;
  const Eigen::Vector3d centre = (cell.array() + 0.5) * MapAxes::kCell;
  return maps_.emplace(key, axes_.ToMapNear(centre)).first->second;
}

}  // namespace mono3d
