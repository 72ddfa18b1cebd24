// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/model_parts.h"

#include <algorithm>
#include <array>
#include <iterator>

#include "fusion/surfel.h"

namespace mono3d {
std::size_t ViewOfSlot(std::span<const std::uint32_t> first_slots, std::uint32_t slot) {
  const auto behind = std::upper_bound(first_slots.begin(), first_slots.end(), slot);
  return static_cast<std::size_t>(std::max<std::ptrdiff_t>(behind - first_slots.begin() - 1, 0));
}

std::vector<int> Submaps(std::span<const FusedView> views) {
  std::vector<int> submaps;
  for (const FusedView& view : views) {
    if (!view.is_break) submaps.push_back(view.submap);
  }
  std::sort(submaps.begin(), submaps.end());
  submaps.erase(std::unique(submaps.begin(), submaps.end()), submaps.end());
  return submaps;
}

std::vector<FusedView> BreakBetween(const FusedView& last, const FusedView& next) {
  std::vector<FusedView> views(kDeformationWindow, last);
  views.insert(views.end(), kDeformationWindow, next);
  for (FusedView& view : views) view.is_break = true;
  return views;
}

std::vector<std::uint32_t> BlocksOfSubmap(std::span<const std::uint32_t> blocks,
                                          std::span<const FusedView> views,
                                          std::span<const std::uint32_t> first_slots, int submap) {
  std::vector<std::uint32_t> chosen;
  if (views.empty()) return chosen;
  const auto is_of_submap = [&](std::uint32_t slot) {
    return views[std::min(ViewOfSlot(first_slots, slot), views.size() - 1)].submap == submap;
  };
  for (const std::uint32_t block : blocks) {
    const std::uint32_t first = block * kSurfelsPerBlock;
    if (is_of_submap(first) || is_of_submap(first + kSurfelsPerBlock - 1)) chosen.push_back(block);
  }
  return chosen;
}

std::vector<Similarity> MoveSubmap(std::vector<FusedView>& views, int submap,
                                   const Similarity& motion) {
  std::vector<Similarity> motions;
  for (FusedView& view : views) {
    const bool moves = view.submap == submap;
    motions.push_back(moves ? motion : Similarity());
    if (!moves) continue;
    view.S_world_kf = motion * view.S_world_kf;
  }
  return motions;
}

std::vector<std::size_t> ViewsAcross(std::span<const FusedView> views,
                                     const std::vector<bool>& is_other, std::size_t max_views) {
  std::vector<std::array<Eigen::Vector3d, 9>> places;
  std::transform(views.begin(), views.end(), std::back_inserter(places), Places);
  std::vector<std::size_t> candidates;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (views[i].is_break) continue;
    for (std::size_t k = 0; k < views.size(); ++k) {
      const bool sees_other =
          is_other[i] != is_other[k] &&
          std::any_of(places[k].begin(), places[k].end(),
                      [&](const Eigen::Vector3d& place) { return Sees(views[i], place); });
      if (!sees_other) continue;
      candidates.push_back(i);
      break;
    }
  }
  return Evenly(candidates, max_views);
}

Similarity ModelFromTracker(const FusedView& view) {
  return view.S_world_kf * view.S_tracker_kf.Inverse();
}

}  // namespace mono3d
