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

// Hamming distance, 0 to 256.
int Distance(const Descriptor& a, const Descriptor& b);

// The position of the descriptor with the least median distance to the others; `descriptors` must
// not be empty.
std::size_t MostTypical(std::span<const Descriptor> descriptors);

}  // namespace mono3d::tracking
