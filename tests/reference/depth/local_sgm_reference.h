// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace mono3d::reference {

// What prior.comp says of a pixel.
struct LocalRange {
  int first_plane = 0;
  int grey = 0;
  bool narrow = false;         // only planes 4 to 11 are matched
  std::array<int, 8> jumps{};  // by direction
};

inline constexpr int kNumLocalPlanes = 16;

// Costs of all pixels in rows, 16 planes of each.
using LocalVolume = std::vector<std::array<std::uint8_t, kNumLocalPlanes>>;

// The path costs of one direction (local_sgm.comp).
LocalVolume LocalPath(const LocalVolume& costs, const std::vector<LocalRange>& ranges, int width,
                      int direction, int p1, const std::array<std::uint32_t, 256>& jump_penalties);

}  // namespace mono3d::reference
