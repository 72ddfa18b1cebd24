// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reference/depth/fine_winner_reference.h"

#include <algorithm>
#include <cstdlib>

namespace mono3d::reference {

Winners FineWinners(const std::vector<FineVolume>& paths, const FineVolume& costs,
                    const std::vector<FineRange>& ranges, const FineWinnerParams& params) {
  Winners winners;
  for (std::size_t pixel = 0; pixel < costs.size(); ++pixel) {
    std::array<int, kNumFinePlanes> sums{};
    for (const FineVolume& path : paths) {
      for (std::size_t d = 0; d < sums.size(); ++d) sums[d] += path[pixel][d];
    }
    const auto best =
        static_cast<std::size_t>(std::min_element(sums.begin(), sums.end()) - sums.begin());
    int second = 1 << 20;
    for (std::size_t d = 0; d < sums.size(); ++d) {
      if (std::abs(int(d) - int(best)) > 1) second = std::min(second, sums[d]);
    }
    const double uniqueness = second > 0 ? 1 - double(sums[best]) / second : 0;
    double offset = 0;
    if (best > 0 && best + 1 < sums.size()) {
      const double curvature = sums[best - 1] - 2.0 * sums[best] + sums[best + 1];
      if (curvature > 0) offset = (sums[best - 1] - sums[best + 1]) / (2 * curvature);
    }
    double w = params.inverse_depth + (ranges[pixel].first_plane + double(best) + offset) *
                                          double(params.inverse_depth_step);
    const bool valid =
        costs[pixel][best] <= params.max_cost && uniqueness >= double(params.min_uniqueness);
    if (!valid) w = costs[pixel][best] < 255 ? -w : 0;
    winners.inverse_depth.push_back(static_cast<float>(w));
    winners.uniqueness.push_back(w > 0 ? static_cast<float>(uniqueness) : 0.f);
  }
  return winners;
}

}  // namespace mono3d::reference
