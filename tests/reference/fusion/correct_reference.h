// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <span>
#include <vector>

#include "fusion/deformation.h"
#include "reference/fusion/fusion_reference.h"

// The stages of a correction without a device.
namespace mono3d::reference {

// In double precision.
void Deform(std::span<const DeformationNode> nodes, std::uint32_t window, Surfels& surfels);

// Per surfel the older one in its place, or kUnseen.
std::vector<std::uint32_t> FindTargets(const ViewParams& view,
                                       const std::vector<IndexCell>& index_map,
                                       const Surfels& surfels);

// Adds each surfel to its target and removes it. Returns how many.
std::uint32_t AddToTargets(const ViewParams& view, const std::vector<std::uint32_t>& targets,
                           Surfels& surfels);

}  // namespace mono3d::reference
