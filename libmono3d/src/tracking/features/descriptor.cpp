// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/features/descriptor.h"

#include <algorithm>
#include <vector>

namespace mono3d::tracking {
namespace {

// Bits set in each of many bytes at once: no assumption about the processor's instructions.
std::uint64_t ByteCounts(std::uint64_t x) {
  x = x - ((x >> 1) & 0x5555555555555555U);
  x = (x & 0x3333333333333333U) + ((x >> 2) & 0x3333333333333333U);
  return (x + (x >> 4)) & 0x0f0f0f0f0f0f0f0fU;
}

}  // namespace

int Distance(const Descriptor& a, const Descriptor& b) {
  // Four words add up to at most 32 a byte, so one multiplication sums them all.
  const std::uint64_t counts = ByteCounts(a[0] ^ b[0]) + ByteCounts(a[1] ^ b[1]) +
                               ByteCounts(a[2] ^ b[2]) + ByteCounts(a[3] ^ b[3]);
  const std::uint64_t even = counts & 0x00ff00ff00ff00ffU;
  const std::uint64_t odd = (counts >> 8) & 0x00ff00ff00ff00ffU;
  return static_cast<int>(((even + odd) * 0x0001000100010001U) >> 48);
}

std::size_t MostTypical(std::span<const Descriptor> descriptors) {
  std::size_t best = 0;
  int best_median = kDescriptorBits + 1;
  std::vector<int> distances(descriptors.size());
  for (std::size_t i = 0; i < descriptors.size(); ++i) {
    for (std::size_t j = 0; j < descriptors.size(); ++j) {
      distances[j] = Distance(descriptors[i], descriptors[j]);
    }
    const auto middle = distances.begin() + static_cast<std::ptrdiff_t>((distances.size() - 1) / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    if (*middle < best_median) {
      best_median = *middle;
      best = i;
    }
  }
  return best;
}

}  // namespace mono3d::tracking
