// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace mono3d {

// Where the selected pixels go: each keeps its place in the order of the pixels, so that the same
// input gives the same model whatever order the device works in.
struct Selection {
  std::vector<std::uint32_t> num_before;  // per word: bits set in the words before it
  std::uint32_t num_selected = 0;
};

// Counts a bit mask of 32 pixels a word.
Selection CountSelected(std::span<const std::uint32_t> mask);

}  // namespace mono3d
