// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/surfel_bounds.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace mono3d {

std::vector<Surfels::Float4> BoundsOf(const Surfels& surfels) {
  std::vector<Surfels::Float4> bounds;
  for (std::size_t first = 0; first < surfels.size(); first += kSurfelsPerBlock) {
    std::array<float, 3> least{3.4e38F, 3.4e38F, 3.4e38F};
    std::array<float, 3> most{-3.4e38F, -3.4e38F, -3.4e38F};
    const std::size_t end = std::min(first + kSurfelsPerBlock, surfels.size());
    bool is_empty = true;
    for (std::size_t i = first; i < end; ++i) {
      if (IsRemoved(surfels, i)) continue;
      is_empty = false;
      for (std::size_t k = 0; k < 3; ++k) {
        least.at(k) = std::min(least.at(k), surfels.position_radius[i].at(k));
        most.at(k) = std::max(most.at(k), surfels.position_radius[i].at(k));
      }
    }
    Surfels::Float4 sphere{0, 0, 0, -1};
    if (!is_empty) {
      float squared = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        sphere.at(k) = 0.5F * (least.at(k) + most.at(k));
        squared += (most.at(k) - least.at(k)) * (most.at(k) - least.at(k));
      }
      sphere[3] = 0.501F * std::sqrt(squared);
    }
    bounds.push_back(sphere);
  }
  return bounds;
}

Surfels::Float4 Around(std::span<const Surfels::Float4> spheres) {
  std::array<double, 3> least{}, most{};
  bool is_empty = true;
  for (const Surfels::Float4& sphere : spheres) {
    if (sphere[3] < 0) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const double from = double{sphere.at(k)} - sphere[3];
      const double to = double{sphere.at(k)} + sphere[3];
      least.at(k) = is_empty ? from : std::min(least.at(k), from);
      most.at(k) = is_empty ? to : std::max(most.at(k), to);
    }
    is_empty = false;
  }
  if (is_empty) return {0, 0, 0, -1};
  Surfels::Float4 whole{};
  double squared = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    whole.at(k) = static_cast<float>(0.5 * (least.at(k) + most.at(k)));
    squared += (most.at(k) - least.at(k)) * (most.at(k) - least.at(k));
  }
  whole[3] = static_cast<float>(0.501 * std::sqrt(squared));
  return whole;
}

}  // namespace mono3d
