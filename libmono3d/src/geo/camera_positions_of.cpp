// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <cmath>
#include <optional>
#include <vector>

#include "geo/position_fit.h"
#include "geo/position_pairs.h"
#include "geo/position_priors.h"
#include "mono3d/geo/georeference.h"

namespace mono3d {
namespace {

Eigen::Vector3d SigmaOf(const PositionFix& fix, const PositionTrack& track,
                        const Georeference& georeference) {
  const auto all = [](const PositionNoise& noise) {
    return std::hypot(noise.wander_m, noise.white_m);
  };
  const double rounding_m = track.resolution_m / std::sqrt(12.0);  // of an even distribution
  const bool is_stated = fix.sigma_horizontal_m > 0;
  const double horizontal_m =
      is_stated ? std::hypot(fix.sigma_horizontal_m, rounding_m) : all(georeference.horizontal);
  // Heights err twice as much as places, where only these are stated.
  const double vertical_m = fix.sigma_vertical_m > 0 ? fix.sigma_vertical_m
                            : is_stated              ? 2 * fix.sigma_horizontal_m
                                                     : all(georeference.vertical);
  return {horizontal_m, horizontal_m, vertical_m};
}

}  // namespace

std::optional<Geodetic> OriginOf(const PositionTrack& track) {
  if (track.fixes.empty()) return std::nullopt;
  return PositionPairs({}, track).origin();
}

CameraPositions CameraPositionsOf(std::span<const PositionedCamera> cameras,
                                  const PositionTrack& track, const Georeference& georeference,
                                  const GeoreferenceOptions& options) {
  options.Validate();
  CameraPositions positions;
  positions.S_metric_map = georeference.S_enu_map;
  const PositionPairs pairs_of(cameras, track);
  const PlacementPriors priors = PriorsFor(track, pairs_of, std::nullopt, options);
  positions.has_vertical = priors.has_vertical;
  positions.typical_horizontal_m = priors.horizontal_m;
  positions.typical_vertical_m = priors.vertical_m;
  positions.worth = priors.worth;
  // The path may have been bent where the clock was taken for the wrong one: it is found anew
  // together with the path, from what was known before.
  positions.clock_offset_sigma_s = priors.clock_offset_sigma_s;
  const bool is_of_day = track.clock == PositionClock::kUnix && options.clock_offset_s == 0;
  if (!is_of_day && priors.clock_offset_sigma_s > 0) {
    positions.clock_offset_s = options.clock_offset_s - georeference.clock_offset_s;
  }
  const std::vector<PositionPair> pairs = pairs_of.At(georeference.clock_offset_s);
  const std::vector<bool> are_frozen =
      AreFrozen(pairs, georeference.S_enu_map.scale(), kFarPosition * priors.horizontal_m);
  const Eigen::Quaterniond& R_enu_map = georeference.S_enu_map.pose().rotation();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (are_frozen[i]) continue;
    const Eigen::Vector3d antenna_m = R_enu_map * (pairs[i].R_map_cam * priors.antenna_m);
    CameraPosition position{pairs[i].time_s, pairs[i].p_enu_m - antenna_m};
    if (track.clock == PositionClock::kImages) {
      position.frame_index = pairs[i].frame_index;
      position.sigma_m = SigmaOf(track.fixes[pairs[i].fix], track, georeference);
    }
    positions.positions.push_back(position);
  }
  return positions;
}

}  // namespace mono3d
