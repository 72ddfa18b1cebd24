// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace mono3d::tracking {

// 256 bits of ORB.
using Descriptor = std::array<std::uint64_t, 4>;

inline constexpr int kDescriptorBits = 256;

// Hamming distances of ORB up to which two patches pass for the same, 30 degrees of rotation and
// some change of light between them (Mur-Artal, Montiel, Tardos 2015).
inline constexpr int kCloseDistance = 50;
inline constexpr int kFarDistance = 100;

// Of the distance to the most similar descriptor over that to the second: beyond, which one is
// meant is open (Lowe 2004).
inline constexpr double kMaxDistanceRatio = 0.8;

// Hamming distance, 0 to 256.
int Distance(const Descriptor& a, const Descriptor& b);

// The position of the descriptor with the least median distance to the others; `descriptors` must
// not be empty.
std::size_t MostTypical(std::span<const Descriptor> descriptors);

}  // namespace mono3d::tracking
