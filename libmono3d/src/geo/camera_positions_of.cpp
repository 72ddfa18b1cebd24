// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <optional>
#include <vector>

#include "geo/position_fit.h"
#include "geo/position_pairs.h"
#include "geo/position_priors.h"
#include "mono3d/geo/georeference.h"

namespace mono3d {

CameraPositions CameraPositionsOf(std::span<const PositionedCamera> cameras,
                                  const PositionTrack& track, const Georeference& georeference,
                                  const GeoreferenceOptions& options) {
  options.Validate();
  CameraPositions positions;
  positions.S_metric_map = georeference.S_enu_map;
  if (track.clock == PositionClock::kImages) return positions;
  const PositionPairs pairs_of(cameras, track);
  const PlacementPriors priors = PriorsFor(track, pairs_of, std::nullopt, options);
  positions.has_vertical = priors.has_vertical;
  positions.typical_horizontal_m = priors.horizontal_m;
  positions.typical_vertical_m = priors.vertical_m;
  positions.worth = priors.worth;
  const std::vector<PositionPair> pairs = pairs_of.At(georeference.clock_offset_s);
  const std::vector<bool> are_frozen =
      AreFrozen(pairs, georeference.S_enu_map.scale(), kFarPosition * priors.horizontal_m);
  const Eigen::Quaterniond& R_enu_map = georeference.S_enu_map.pose().rotation();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (are_frozen[i]) continue;
    const Eigen::Vector3d antenna_m = R_enu_map * (pairs[i].R_map_cam * priors.antenna_m);
    positions.positions.push_back({pairs[i].time_s, pairs[i].p_enu_m - antenna_m});
  }
  return positions;
}

}  // namespace mono3d
