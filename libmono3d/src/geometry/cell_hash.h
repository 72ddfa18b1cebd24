// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace mono3d {

// Of the indices of a cell of a grid, for unordered containers: neighbours come to lie far apart.
template <std::size_t NumIndices>
struct CellHash {
  std::size_t operator()(const std::array<std::int64_t, NumIndices>& cell) const {
    std::uint64_t hash = 0;
    for (const std::int64_t index : cell) {
      hash = (hash ^ static_cast<std::uint64_t>(index)) * 0x9E3779B97F4A7C15ULL;
      hash ^= hash >> 32;
    }
    return hash;
  }
};

}  // namespace mono3d
