// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reference/depth/plane_sweep_reference.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <span>

namespace mono3d::reference {
namespace {

std::optional<int> Distance(const CensusImages& census, std::uint64_t reference, std::size_t source,
                            const Eigen::Vector3d& at, const PixelBounds& bounds,
                            const PlaneSweepParams& params) {
  if (at.z() <= 0) return std::nullopt;
  const int x = static_cast<int>(std::floor(at.x() / at.z() + 0.5));
  const int y = static_cast<int>(std::floor(at.y() / at.z() + 0.5));
  const int width = static_cast<int>(params.width_px);
  const int height = static_cast<int>(params.height_px);
  if (x < 0 || y < 0 || x >= width || y >= height) return std::nullopt;
  if (!bounds.Contain({x, y})) return std::nullopt;
  return std::popcount(census[1 + source][static_cast<std::size_t>(y * width + x)] ^ reference);
}

// Twice the mean of those that are there, rounded.
int CoarseSideCost(std::span<const std::optional<int>> distances) {
  int sum = 0, num_valid = 0;
  for (const std::optional<int>& distance : distances) {
    sum += distance.value_or(0);
    num_valid += distance ? 1 : 0;
  }
  return num_valid > 0 ? static_cast<int>(std::floor(2.0 * sum / num_valid + 0.5)) : 255;
}

}  // namespace

int BothSides(int before, int after, int tolerance) {
  const int better = std::min(before, after);
  const int worse = std::max(before, after);
  return worse == 255 ? better : better + std::min((worse - better) / 2, tolerance);
}

std::vector<std::uint8_t> PlaneSweep(const CensusImages& census,
                                     const SourceProjections& projections,
                                     const PlaneSweepParams& params, int side_tolerance) {
  const std::size_t num_pixels = std::size_t{params.width_px} * params.height_px;
  std::vector<std::uint8_t> costs(num_pixels * params.padded_planes, 255);
  for (std::size_t pixel = 0; pixel < num_pixels; ++pixel) {
    const Eigen::Vector3d p(double(pixel % params.width_px), double(pixel / params.width_px), 1);
    for (std::size_t k = 0; k < params.num_planes; ++k) {
      const double w = params.inverse_depth + double(k) * params.inverse_depth_step;
      std::vector<std::optional<int>> distances(projections.size());
      for (std::size_t s = 0; s < projections.size(); ++s) {
        const Eigen::Vector3d at = projections[s].A * p + w * projections[s].b;
        if (!projections[s].reference.Contain(p.head<2>())) continue;
        distances[s] = Distance(census, census[0][pixel], s, at, projections[s].bounds, params);
      }
      const std::span<const std::optional<int>> all(distances);
      const int cost = BothSides(CoarseSideCost(all.first(projections.size() / 2)),
                                 CoarseSideCost(all.last(projections.size() / 2)), side_tolerance);
      costs[pixel * params.padded_planes + k] = static_cast<std::uint8_t>(cost);
    }
  }
  return costs;
}

}  // namespace mono3d::reference
