// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace mono3d::reference {

// What prior.comp says of a pixel.
struct FineRange {
  int first_plane = 0;
  int grey = 0;
  bool narrow = false;         // only planes 4 to 11 are matched
  std::array<int, 8> jumps{};  // by direction
};

inline constexpr int kNumFinePlanes = 16;

// Costs of all pixels in rows, 16 planes of each.
using FineVolume = std::vector<std::array<std::uint8_t, kNumFinePlanes>>;

// The path costs of one direction (fine_sgm.comp).
FineVolume FinePath(const FineVolume& costs, const std::vector<FineRange>& ranges, int width,
                    int direction, int p1, const std::array<std::uint32_t, 256>& jump_penalties);

}  // namespace mono3d::reference
