// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/coarsen.h"

#include <array>
#include <cmath>
#include <unordered_map>
#include <vector>

#include "geometry/cell_hash.h"

namespace mono3d {
namespace {

// The octave of its radius, and the cell of the grid of that octave.
using OctaveCell = std::array<std::int64_t, 4>;

OctaveCell CellOf(const Surfels::Float4& position_radius) {
  const double octave = std::round(std::log2(position_radius[3]));
  // A surfel's radius is the diagonal of a pixel: they are 1 / sqrt(2) of it apart.
  const double edge_su = std::exp2(octave) * std::sqrt(2.0);
  OctaveCell cell = {static_cast<std::int64_t>(octave)};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    cell[axis + 1] = static_cast<std::int64_t>(std::floor(position_radius[axis] / edge_su));
  }
  return cell;
}

}  // namespace

Surfels Coarsened(const Surfels& surfels) {
  std::unordered_map<OctaveCell, std::size_t, CellHash<4>> strongest_of;
  strongest_of.reserve(surfels.size() / 2);  // about a third remain
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    if (IsRemoved(surfels, i)) continue;
    const auto [entry, is_new] = strongest_of.try_emplace(CellOf(surfels.position_radius[i]), i);
    std::size_t& strongest = entry->second;
    if (surfels.normal_weight[i][3] > surfels.normal_weight[strongest][3]) strongest = i;
  }
  std::vector<bool> is_kept(surfels.size());
  for (const auto& [cell, strongest] : strongest_of) is_kept[strongest] = true;
  Surfels coarse;
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    if (!is_kept[i]) continue;
    coarse.position_radius.push_back(surfels.position_radius[i]);
    coarse.position_radius.back()[3] *= 2;
    coarse.normal_weight.push_back(surfels.normal_weight[i]);
    coarse.history.push_back(surfels.history[i]);
  }
  return coarse;
}

void KeepEveryPixel(std::uint32_t step, std::uint32_t width_px, std::span<std::uint32_t> mask) {
  for (std::size_t word = 0; word < mask.size(); ++word) {
    for (std::uint32_t bit = 0; bit < 32; ++bit) {
      const std::size_t pixel = 32 * word + bit;
      if (pixel % width_px % step == 0 && pixel / width_px % step == 0) continue;
      mask[word] &= ~(1U << bit);
    }
  }
}

}  // namespace mono3d
