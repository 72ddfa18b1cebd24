// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <span>
#include <vector>

#include "fusion/surfel.h"

namespace mono3d {

// What surrounds surfels: centre and radius, in the frame of their anchor; a negative radius where
// there are none.

// One for each block. As shaders/fusion/bound_blocks.comp has it, but for rounding; good enough to
// say what may be seen of a block that the device has not bounded yet.
std::vector<Surfels::Float4> BoundsOf(const Surfels& surfels);

// A sphere around all of them.
Surfels::Float4 Around(std::span<const Surfels::Float4> spheres);

}  // namespace mono3d
