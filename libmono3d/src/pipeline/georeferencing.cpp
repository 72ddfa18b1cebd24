// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/pipeline/georeferencing.h"

#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "mono3d/pipeline/world_axes.h"

namespace mono3d {

std::vector<PositionedCamera> PositionedCamerasOf(const MapReconstruction& map,
                                                  PositionClock clock) {
  std::vector<PositionedCamera> cameras;
  if (clock == PositionClock::kImages) {
    for (const SparseImage& image : map.sparse.images) {
      const double order = static_cast<double>(image.id);
      cameras.push_back({order, image.name, image.T_world_cam});
    }
  } else {
    for (const TrajectoryEntry& frame : map.trajectory) {
      cameras.push_back({frame.timestamp_s, {}, frame.T_world_cam});
    }
  }
  return cameras;
}

std::optional<UpDirection> UpOf(const MapReconstruction& map,
                                const std::vector<PositionedCamera>& cameras,
                                const PositionTrack& track, int turn_deg) {
  if (const std::optional<UpDirection> up = UpFromGimbal(cameras, track)) return up;
  // Level axes were within 1.5 degrees of flights with relief and within 4 of photographs that look
  // straight down.
  constexpr double kSigma_rad = 4 * std::numbers::pi / 180;
  const WorldAxes level = ChooseWorldAxes(map, turn_deg);
  if (level.source != AxesSource::kLevel) return std::nullopt;
  return UpDirection{level.S_axes_world.pose().rotation().inverse() * Eigen::Vector3d::UnitZ(),
                     kSigma_rad};
}

void PlaceOnEarth(const PositionTrack& track, const GeoreferenceOptions& options, int turn_deg,
                  MapReconstruction& map) {
  const std::vector<PositionedCamera> cameras = PositionedCamerasOf(map, track.clock);
  GeoreferenceResult result =
      EstimateGeoreference(cameras, track, UpOf(map, cameras, track, turn_deg), options);
  map.why_no_georeference = std::move(result.reason);
  if (!result.georeference) return;
  MoveInto({result.georeference->S_enu_map, AxesSource::kEarth}, map);
  map.georeference = std::move(result.georeference);
}

}  // namespace mono3d
