// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/selection.h"

#include <bit>

namespace mono3d {

Selection CountSelected(std::span<const std::uint32_t> mask) {
  Selection selection;
  selection.num_before.reserve(mask.size());
  for (const std::uint32_t word : mask) {
    selection.num_before.push_back(selection.num_selected);
    selection.num_selected += static_cast<std::uint32_t>(std::popcount(word));
  }
  return selection;
}

}  // namespace mono3d
