// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "fusion/anchor_map.h"

namespace mono3d {

// At most `max_count` of the numbers, evenly among them, the first and the last among these.
std::vector<std::uint32_t> Evenly(const std::vector<std::uint32_t>& numbers, std::size_t max_count);

// The anchors from which to look for parts of the model that have moved against each other by a
// pixel or more since they were at `S_world_kf_before`. O(anchors^2).
std::vector<std::uint32_t> ViewsOfOverlap(const AnchorMap& anchors,
                                          std::span<const Similarity> S_world_kf_before);

// Anchors of one part that see what anchors of the other look at, `is_other` telling the two apart.
std::vector<std::uint32_t> ViewsAcross(const AnchorMap& anchors, const std::vector<bool>& is_other);

}  // namespace mono3d
