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
using CoarseCell = std::array<std::int64_t, 4>;

CoarseCell CoarseCellOf(const Surfels::Float4& position_radius, const Similarity& S_world_anchor) {
  const double octave = std::round(std::log2(S_world_anchor.scale() * position_radius[3]));
  // A surfel's radius is the diagonal of a pixel: they are 1 / sqrt(2) of it apart.
  const double edge_su = std::exp2(octave) * std::sqrt(2.0);
  const Eigen::Vector3d p_world =
      S_world_anchor * Eigen::Vector3d(position_radius[0], position_radius[1], position_radius[2]);
  CoarseCell cell = {static_cast<std::int64_t>(octave)};
  for (int axis = 0; axis < 3; ++axis) {
    cell.at(static_cast<std::size_t>(axis) + 1) =
        static_cast<std::int64_t>(std::floor(p_world[axis] / edge_su));
  }
  return cell;
}

}  // namespace

Surfels Coarsened(const Surfels& surfels, std::span<const Similarity> S_world_anchor) {
  std::unordered_map<CoarseCell, std::size_t, CellHash<4>> strongest_of;
  strongest_of.reserve(surfels.size() / 2);  // about a third remain
  const auto weight_in_world = [&](std::size_t i) {
    const double scale = S_world_anchor[AnchorOf(surfels, i)].scale();
    return surfels.normal_weight[i][3] / (scale * scale);
  };
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    if (IsRemoved(surfels, i)) continue;
    const Similarity& S = S_world_anchor[AnchorOf(surfels, i)];
    const auto [entry, is_new] =
        strongest_of.try_emplace(CoarseCellOf(surfels.position_radius[i], S), i);
    std::size_t& strongest = entry->second;
    if (weight_in_world(i) > weight_in_world(strongest)) strongest = i;
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
