// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/selection.h"

#include <bit>

namespace mono3d {

std::vector<std::uint32_t> ListSelected(std::span<const std::uint32_t> mask) {
  std::vector<std::uint32_t> pixels;
  for (std::size_t i = 0; i < mask.size(); ++i) {
    for (std::uint32_t left = mask[i]; left != 0; left &= left - 1) {
      pixels.push_back(static_cast<std::uint32_t>(32 * i) +
                       static_cast<std::uint32_t>(std::countr_zero(left)));
    }
  }
  return pixels;
}

}  // namespace mono3d
