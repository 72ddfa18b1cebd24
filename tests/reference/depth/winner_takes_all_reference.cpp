// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reference/depth/winner_takes_all_reference.h"

#include <algorithm>
#include <cstdlib>
#include <limits>

namespace mono3d::reference {
namespace {

struct Winner {
  double plane = -1;  // with its fraction; -1: none
  double uniqueness = 0;
};

Winner Choose(const std::uint16_t* sums, const std::uint8_t* costs,
              const WinnerTakesAllParams& params) {
  const auto num_padded = static_cast<std::ptrdiff_t>(params.padded_planes);
  const std::ptrdiff_t best = std::min_element(sums, sums + num_padded) - sums;
  double second = std::numeric_limits<std::uint16_t>::max();
  for (std::ptrdiff_t d = 0; d < num_padded; ++d) {
    if (std::abs(d - best) > 1) second = std::min(second, double(sums[d]));
  }
  const double uniqueness = second > 0 ? 1 - sums[best] / second : 0;
  if (best == 0 || best + 1 >= static_cast<std::ptrdiff_t>(params.num_planes) ||
      costs[best] > params.max_cost || uniqueness < double(params.min_uniqueness)) {
    return {};
  }
  const double below = sums[best - 1];
  const double above = sums[best + 1];
  const double curvature = below - 2.0 * sums[best] + above;
  const double offset = curvature > 0 ? (below - above) / (2 * curvature) : 0;
  return {double(best) + offset, uniqueness};
}

}  // namespace

Winners WinnerTakesAll(const std::vector<std::uint16_t>& sums,
                       const std::vector<std::uint8_t>& costs, const WinnerTakesAllParams& params) {
  Winners winners;
  for (std::size_t first = 0; first < sums.size(); first += params.padded_planes) {
    const Winner winner = Choose(sums.data() + first, costs.data() + first, params);
    const double w = params.inverse_depth + winner.plane * params.inverse_depth_step;
    winners.inverse_depth.push_back(winner.plane < 0 ? 0.f : static_cast<float>(w));
    winners.uniqueness.push_back(static_cast<float>(winner.uniqueness));
  }
  return winners;
}

}  // namespace mono3d::reference
