// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/surfel.h"

namespace mono3d {
namespace {

void AppendOne(const Surfels& from, std::size_t i, Surfels& to) {
  to.position_radius.push_back(from.position_radius[i]);
  to.normal_weight.push_back(from.normal_weight[i]);
  to.history.push_back(from.history[i]);
}

void FillUpBlock(Surfels& surfels) {
  if (surfels.size() == 0) return;
  const std::uint32_t anchor = AnchorOf(surfels, surfels.size() - 1);
  while (surfels.size() % kSurfelsPerBlock != 0) {
    surfels.position_radius.push_back({});
    surfels.normal_weight.push_back({});
    surfels.history.push_back({0, 0, 0, anchor});
  }
}

}  // namespace

void Append(const Surfels& from, Surfels& to) {
  const auto append = [](const auto& more, auto& all) {
    all.insert(all.end(), more.begin(), more.end());
  };
  append(from.position_radius, to.position_radius);
  append(from.normal_weight, to.normal_weight);
  append(from.history, to.history);
}

std::uint32_t NumThere(const Surfels& surfels) {
  std::uint32_t count = 0;
  for (std::size_t i = 0; i < surfels.size(); ++i) count += IsRemoved(surfels, i) ? 0 : 1;
  return count;
}

Surfels InWholeBlocks(const Surfels& surfels) {
  Surfels closed;
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    if (IsRemoved(surfels, i)) continue;
    const bool is_of_next =
        closed.size() > 0 && AnchorOf(surfels, i) != AnchorOf(closed, closed.size() - 1);
    if (is_of_next) FillUpBlock(closed);
    AppendOne(surfels, i, closed);
  }
  FillUpBlock(closed);
  return closed;
}

}  // namespace mono3d
