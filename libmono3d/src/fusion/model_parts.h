// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "fusion/deformation.h"

namespace mono3d {

// A submap is a part of the model that hangs together with the others by the tracker's poses alone:
// no depth map has shown it together with another one yet. FusedView::submap tells which.

// The view to which the surfel in this slot is anchored. `first_slots` as SurfelStorage has it.
std::size_t ViewOfSlot(std::span<const std::uint32_t> first_slots, std::uint32_t slot);

// The submaps of the views, oldest first.
std::vector<int> Submaps(std::span<const FusedView> views);

// What stands between two views that are no neighbours, though one follows the other: so many
// repetitions of either that no surfel follows views of the other side, and that both sides count
// as parts that may have to be merged.
std::vector<FusedView> BreakBetween(const FusedView& last, const FusedView& next);

// Of these blocks of surfels, those that hold some anchored to views of the submap.
std::vector<std::uint32_t> BlocksOfSubmap(std::span<const std::uint32_t> blocks,
                                          std::span<const FusedView> views,
                                          std::span<const std::uint32_t> first_slots, int submap);

// Moves the views of one submap, the others stay. Returns how each has moved.
std::vector<Similarity> MoveSubmap(std::vector<FusedView>& views, int submap,
                                   const Similarity& motion);

// Views of one part that see what views of the other look at, `is_other` telling the two apart: at
// most `max_views`, evenly among them.
std::vector<std::size_t> ViewsAcross(std::span<const FusedView> views,
                                     const std::vector<bool>& is_other, std::size_t max_views);

// How the tracker's world around the view lies in the model's.
Similarity ModelFromTracker(const FusedView& view);

}  // namespace mono3d
