// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "geo/position_priors.h"

#include <cmath>
#include <utility>
#include <vector>

#include "mono3d/core/statistics.h"

namespace mono3d {
namespace {

// What receivers of drones and telephones do without corrections, and how well a barometer holds.
constexpr double kTypicalHorizontal_m = 1.5;
constexpr double kTypicalVertical_m = 1.5;
// What that is worth beside the residuals, in independent errors: one is a factor of three either
// way, as between open sky and a street. What a receiver itself states, by its own count of
// satellites, is worth more.
constexpr double kTypicalWorth = 1;
constexpr double kStatedWorth = 4;

double MedianStated(const PositionTrack& track, double PositionFix::*sigma) {
  std::vector<double> stated;
  for (const PositionFix& fix : track.fixes) {
    if (fix.*sigma > 0) stated.push_back(fix.*sigma);
  }
  // Where most tell nothing, it is not known.
  return 2 * stated.size() < track.fixes.size() ? 0 : UpperMedianOrZero(std::move(stated));
}

}  // namespace

PlacementPriors PriorsFor(const PositionTrack& track, const PositionPairs& pairs,
                          const std::optional<UpDirection>& up,
                          const GeoreferenceOptions& options) {
  PlacementPriors priors;
  priors.up = up;
  priors.clock_offset_s = options.clock_offset_s;
  if (track.clock != PositionClock::kImages) {
    priors.clock_offset_sigma_s = options.clock_offset_sigma_s;
  }
  priors.antenna_m = {options.antenna_right_m, options.antenna_down_m, options.antenna_forward_m};
  priors.has_vertical = pairs.has_vertical();
  const double stated_m = MedianStated(track, &PositionFix::sigma_horizontal_m);
  const double stated_vertical_m = MedianStated(track, &PositionFix::sigma_vertical_m);
  const double rounding_m = track.resolution_m / std::sqrt(12.0);  // of an even distribution
  priors.horizontal_m = std::hypot(stated_m > 0 ? stated_m : kTypicalHorizontal_m, rounding_m);
  // Heights err twice as much as places, where only these are stated.
  priors.vertical_m = stated_vertical_m > 0 ? stated_vertical_m
                      : stated_m > 0        ? 2 * stated_m
                                            : kTypicalVertical_m;
  priors.worth = stated_m > 0 ? kStatedWorth : kTypicalWorth;
  return priors;
}

}  // namespace mono3d
