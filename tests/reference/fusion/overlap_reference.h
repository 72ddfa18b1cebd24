// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "reference/fusion/fusion_reference.h"

// The stages that merge parts of the model, without a device.
namespace mono3d::reference {

// Per surfel the older one in its place, or kUnseen. `end_of_older`: per anchor the end of the
// surfels of older parts.
std::vector<std::uint32_t> FindTargets(const ViewParams& view, const AnchorTransforms& anchors,
                                       const std::vector<std::uint32_t>& end_of_older,
                                       const std::vector<IndexCell>& index_map,
                                       const Surfels& surfels);

// Adds each surfel to its target and removes it. Returns how many.
std::uint32_t AddToTargets(const AnchorTransforms& anchors,
                           const std::vector<std::uint32_t>& targets, Surfels& surfels);

}  // namespace mono3d::reference
