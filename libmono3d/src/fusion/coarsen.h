// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <span>

#include "fusion/surfel.h"
#include "mono3d/geometry/similarity.h"

namespace mono3d {

// Makes a model of about a quarter of the surfels, twice as far apart: of those in one cell of a
// grid as wide as two of them are apart, the one of the largest weight is kept, with twice its
// radius, in the order in which they were. Surfels of different sizes have grids
// of their own. `S_world_anchor`: per anchor.
Surfels Coarsened(const Surfels& surfels, std::span<const Similarity> S_world_anchor);

// Leaves of a bit mask of 32 pixels a word those in every `step`-th row and column of an image.
void KeepEveryPixel(std::uint32_t step, std::uint32_t width_px, std::span<std::uint32_t> mask);

}  // namespace mono3d
