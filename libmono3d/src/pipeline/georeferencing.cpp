// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/pipeline/georeferencing.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "mono3d/core/statistics.h"
#include "mono3d/pipeline/world_axes.h"
#include "pipeline/map_on_earth.h"

namespace mono3d {
namespace {

// What positions and ground control each say of where a map is.
struct PlacesOfMap {
  std::vector<PositionedCamera> cameras;
  GeoreferenceResult by_positions;
  GeoreferenceResult by_control;
};

PlacesOfMap FindPlaces(const MapReconstruction& map, const PipelinePositions& positions) {
  const PositionTrack& track = positions.track;
  PlacesOfMap places;
  places.cameras = PositionedCamerasOf(map, track.clock);
  const std::optional<UpDirection> up = UpOf(map, places.cameras, track, positions.turn_deg);
  if (track.fixes.empty()) {
    places.by_positions.reason = "no positions have come";
  } else {
    places.by_positions = EstimateGeoreference(places.cameras, track, up, positions.georeference);
  }
  if (!positions.control) return places;
  const std::optional<Geodetic> origin =
      track.fixes.empty() ? OriginOf(*positions.control) : OriginOf(track);
  if (!origin) return places;
  places.by_control = EstimateGeoreference(FramesOf(map), *positions.control, *origin, up);
  return places;
}

// How the camera moved at frame `at`, by up to two frames on each side. A frame after a time of
// another order is left out: the polynomial would swing in the longer one.
CameraVelocity VelocityAt(std::span<const TrajectoryEntry> frames, std::size_t at) {
  constexpr std::ptrdiff_t kMostOnSide = 2;
  constexpr double kMaxRatio = 4;  // of the times from one frame to the next
  const auto step_s = [&](std::ptrdiff_t from, std::ptrdiff_t to) {
    return std::abs(frames[static_cast<std::size_t>(to)].timestamp_s -
                    frames[static_cast<std::size_t>(from)].timestamp_s);
  };
  std::vector<LaterPose> around;
  double unit_s = 0;
  for (const std::ptrdiff_t way : {1, -1}) {
    for (std::ptrdiff_t k = 1; k <= kMostOnSide; ++k) {
      const auto from = static_cast<std::ptrdiff_t>(at) + (k - 1) * way;
      const std::ptrdiff_t to = from + way;
      if (to < 0 || to >= std::ssize(frames)) break;
      const double this_s = step_s(from, to);
      if (unit_s > 0 && std::max(this_s, unit_s) > kMaxRatio * std::min(this_s, unit_s)) break;
      if (unit_s == 0) unit_s = this_s;
      const TrajectoryEntry& other = frames[static_cast<std::size_t>(to)];
      around.push_back({other.T_world_cam.Inverse() * frames[at].T_world_cam,
                        other.timestamp_s - frames[at].timestamp_s});
    }
  }
  if (!(unit_s > 0)) return {};
  return VelocityThrough(around, unit_s).value_or(CameraVelocity{});
}

// By how much the cameras are higher by their positions than by the control points.
double HeightDifference(const std::vector<PositionedCamera>& cameras, const Georeference& positions,
                        const Georeference& control) {
  std::vector<double> differences;
  for (const PositionedCamera& camera : cameras) {
    const Eigen::Vector3d& p_map = camera.T_map_cam.translation();
    differences.push_back((positions.S_enu_map * p_map).z() - (control.S_enu_map * p_map).z());
  }
  return UpperMedianOrZero(std::move(differences));
}

// As FindPlaceOnEarth.
GeoreferenceResult PlaceBy(const MapReconstruction& map, const PipelinePositions& positions,
                           const PlacesOfMap& places) {
  if (places.by_control.georeference) return places.by_control;
  if (!positions.control) return places.by_positions;
  GeoreferenceResult result = places.by_positions;
  if (!result.georeference) {
    if (positions.track.fixes.empty()) return places.by_control;
    result.reason += "; " + places.by_control.reason;
    return result;
  }
  result.georeference->why_no_control = places.by_control.reason;
  result.georeference->control =
      ControlResidualsOf(FramesOf(map), *positions.control, *result.georeference);
  return result;
}

// As PositionsToFollow.
std::optional<CameraPositions> FollowedBy(const MapReconstruction& map,
                                          const PipelinePositions& positions,
                                          const PlacesOfMap& places) {
  const std::optional<Georeference>& by_positions = places.by_positions.georeference;
  const std::optional<Georeference>& by_control = places.by_control.georeference;
  if (!by_positions && !by_control) return std::nullopt;
  CameraPositions told;
  // Without positions, what any receiver does.
  constexpr double kTypical_m = 1.5;
  told.typical_horizontal_m = told.typical_vertical_m = kTypical_m;
  if (by_positions) {
    told =
        CameraPositionsOf(places.cameras, positions.track, *by_positions, positions.georeference);
  }
  if (by_control) {
    if (by_positions) {
      const double higher_m = HeightDifference(places.cameras, *by_positions, *by_control);
      for (CameraPosition& position : told.positions) position.p_m.z() -= higher_m;
    }
    told.S_metric_map = by_control->S_enu_map;
    told.points = KnownPointsOf(FramesOf(map), *positions.control, *by_control);
  }
  told.map_id = map.map_id;
  return told;
}

}  // namespace

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

std::vector<FrameInMap> FramesOf(const MapReconstruction& map) {
  std::vector<TrajectoryEntry> entries = map.trajectory;
  std::ranges::stable_sort(entries, {}, &TrajectoryEntry::frame_index);
  std::vector<FrameInMap> frames;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    frames.push_back({entries[i].frame_index, entries[i].T_world_cam, VelocityAt(entries, i)});
  }
  return frames;
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

GeoreferenceResult FindPlaceOnEarth(const MapReconstruction& map,
                                    const PipelinePositions& positions) {
  return PlaceBy(map, positions, FindPlaces(map, positions));
}

std::optional<CameraPositions> PositionsToFollow(const MapReconstruction& map,
                                                 const PipelinePositions& positions) {
  return FollowedBy(map, positions, FindPlaces(map, positions));
}

MapOnEarth FindMapOnEarth(const MapReconstruction& map, const PipelinePositions& positions) {
  const PlacesOfMap places = FindPlaces(map, positions);
  return {PlaceBy(map, positions, places), FollowedBy(map, positions, places)};
}

std::optional<CameraPositions> PositionsOfPhotos(const SparseModel& map,
                                                 const PipelinePositions& positions) {
  if (positions.track.clock != PositionClock::kImages || positions.track.fixes.empty()) {
    return std::nullopt;
  }
  MapReconstruction placed;
  placed.sparse = map;
  for (const SparseImage& image : map.images) {
    placed.trajectory.push_back({image.id, static_cast<double>(image.id), 0, image.T_world_cam});
  }
  std::ranges::stable_sort(placed.trajectory, {}, &TrajectoryEntry::frame_index);
  PipelinePositions by_positions = positions;
  by_positions.control.reset();
  return PositionsToFollow(placed, by_positions);
}

void PlaceOnEarth(const PipelinePositions& positions, MapReconstruction& map) {
  GeoreferenceResult result = FindPlaceOnEarth(map, positions);
  map.why_no_georeference = std::move(result.reason);
  if (result.georeference) PlaceOnEarth(*std::move(result.georeference), map);
}

void PlaceOnEarth(Georeference georeference, MapReconstruction& map) {
  map.why_no_georeference.clear();
  MoveInto({georeference.S_enu_map, AxesSource::kEarth}, map);
  map.georeference = std::move(georeference);
}

}  // namespace mono3d
