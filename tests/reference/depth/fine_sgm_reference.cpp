// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reference/depth/fine_sgm_reference.h"

#include <algorithm>
#include <cstdlib>

namespace mono3d::reference {
namespace {

constexpr std::array<std::array<int, 2>, 8> kFineDirections = {
    {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, -1}, {-1, 1}, {1, -1}}};
constexpr int kNotMatched = 255;

// L'(q, plane) by the plane's number on the grid of the level.
int Before(const std::array<std::uint8_t, kNumFinePlanes>& path, int least, int first, int plane) {
  const int index = plane - first;
  if (index < 0 || index >= kNumFinePlanes) return kNotMatched;
  return path[static_cast<std::size_t>(index)] - least;
}

}  // namespace

FineVolume FinePath(const FineVolume& costs, const std::vector<FineRange>& ranges, int width,
                    int direction, int p1, const std::array<std::uint32_t, 256>& jump_penalties) {
  const auto [dx, dy] = kFineDirections[static_cast<std::size_t>(direction)];
  const int num_pixels = static_cast<int>(costs.size());
  const int height = num_pixels / width;
  FineVolume paths = costs;
  for (int i = 0; i < num_pixels; ++i) {
    const bool backwards = dy < 0 || (dy == 0 && dx < 0);
    const int p = backwards ? num_pixels - 1 - i : i;
    const int x = p % width - dx;
    const int y = p / width - dy;
    if (x < 0 || x >= width || y < 0 || y >= height) continue;
    const auto here = static_cast<std::size_t>(p);
    const auto q = static_cast<std::size_t>(y * width + x);
    const auto penalty = static_cast<int>(
        jump_penalties[static_cast<std::size_t>(std::abs(ranges[here].grey - ranges[q].grey))]);
    const int least = *std::min_element(paths[q].begin(), paths[q].end());
    for (int d = 0; d < kNumFinePlanes; ++d) {
      // The plane of q that lies on p's surface with plane d of p.
      const int plane =
          ranges[here].first_plane + d - ranges[here].jumps[static_cast<std::size_t>(direction)];
      const auto before = [&](int of) {
        return Before(paths[q], least, ranges[q].first_plane, of);
      };
      const int best =
          std::min({before(plane), before(plane - 1) + p1, before(plane + 1) + p1, penalty});
      const auto index = static_cast<std::size_t>(d);
      paths[here][index] = static_cast<std::uint8_t>(std::min(costs[here][index] + best, 255));
    }
  }
  return paths;
}

}  // namespace mono3d::reference
