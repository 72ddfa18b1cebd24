// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/map/map_checks.h"

#include <algorithm>
#include <set>

namespace mono3d::tracking {
namespace {

// What is counted further, as int.
bool IsCounter(int count) { return count >= 0 && count <= 1'000'000'000; }

bool HasPlace(const Map& map, const std::optional<PointId>& point) {
  return !point || point->index < map.points().size();
}

bool AreFeaturesOf(const Map& map, const View& view) {
  return std::ranges::all_of(view.features, [&](const Feature& feature) {
    return IsFeatureOf(map.camera(), map.scales().num_levels(), feature);
  });
}

// Observations of a point and points of a view name each other.
bool ObservationsMatch(const Map& map) {
  std::size_t num_observations = 0;
  for (std::uint32_t index = 0; index < map.points().size(); ++index) {
    const MapPoint& point = map.points()[index];
    if (!point.alive && !point.observations.empty()) return false;
    const auto is_not_later = [](const Observation& a, const Observation& b) {
      return a.keyframe >= b.keyframe;
    };
    if (std::ranges::adjacent_find(point.observations, is_not_later) != point.observations.end()) {
      return false;
    }
    for (const Observation& seen : point.observations) {
      if (seen.keyframe >= map.keyframes().size()) return false;
      const View& view = map.keyframe(seen.keyframe).view;
      if (seen.feature >= view.points.size() ||
          view.points[seen.feature] != PointId{index, point.generation}) {
        return false;
      }
    }
    num_observations += point.observations.size();
  }
  std::size_t num_points = 0;
  for (const MapKeyframe& keyframe : map.keyframes()) {
    num_points += static_cast<std::size_t>(std::ranges::count_if(
        keyframe.view.points, [](const auto& point) { return point.has_value(); }));
  }
  return num_points == num_observations;
}

bool IsPointOf(const Map& map, const MapPoint& point) {
  return IsCounter(point.num_predicted) && IsCounter(point.num_found) &&
         IsCounter(point.num_due_keyframes) && IsCounter(point.num_showing_keyframes) &&
         (!point.alive || (point.patch_keyframe < map.keyframes().size() &&
                           point.created_at < map.keyframes().size() && point.depth_sigma >= 0 &&
                           !point.observations.empty()));
}

}  // namespace

bool IsFeatureOf(const CameraModel& camera, int num_levels, const Feature& feature) {
  return feature.level >= 0 && feature.level < num_levels && feature.pixel.minCoeff() >= -1 &&
         feature.pixel.x() <= camera.width && feature.pixel.y() <= camera.height &&
         feature.angle_deg >= 0 && feature.angle_deg <= 360 && feature.sigma_px >= 0;
}

bool IsKeyframeOf(const Map& map, KeyframeId keyframe) {
  // The anchors of culled keyframes lead to one that is alive.
  for (std::size_t steps = 0; keyframe < map.keyframes().size(); ++steps) {
    if (map.keyframe(keyframe).alive) return true;
    if (steps > map.keyframes().size()) return false;
    keyframe = map.keyframe(keyframe).anchor;
  }
  return false;
}

bool IsViewOf(const Map& map, const View& view) {
  return view.points.size() == view.features.size() && view.frame.camera == map.camera() &&
         AreFeaturesOf(map, view) &&
         std::ranges::all_of(view.points, [&](const auto& point) { return HasPlace(map, point); });
}

bool AreConsistent(const Map& map) {
  std::set<std::int64_t> ids;
  for (KeyframeId id = 0; id < map.keyframes().size(); ++id) {
    const MapKeyframe& keyframe = map.keyframe(id);
    if (!IsViewOf(map, keyframe.view) || !IsKeyframeOf(map, id)) return false;
    if (keyframe.alive && keyframe.view.grid.IsEmpty()) return false;
    // A culled one is fixed to an older one, whose scale it takes over: see Map::ScaleAround.
    if (!keyframe.alive && keyframe.anchor >= id) return false;
    if (!(keyframe.scale > 0) || !IsCounter(keyframe.num_newer_adjusted)) return false;
    if (keyframe.id < 0 || !ids.insert(keyframe.id).second) return false;
  }
  if (!map.keyframes().empty() && !map.keyframe(0).alive) return false;
  const auto is_constraint = [&](const MapConstraint& constraint) {
    return constraint.scale > 0 && IsKeyframeOf(map, constraint.keyframe) &&
           IsKeyframeOf(map, constraint.anchor);
  };
  return ObservationsMatch(map) && std::ranges::all_of(map.constraints(), is_constraint) &&
         std::ranges::all_of(map.points(),
                             [&](const MapPoint& point) { return IsPointOf(map, point); });
}

bool AreFreePlaces(const Map& map, const std::vector<std::uint32_t>& places) {
  std::vector<char> is_free(map.points().size(), 0);
  for (const std::uint32_t place : places) {
    if (place >= map.points().size() || map.points()[place].alive || is_free[place] != 0) {
      return false;
    }
    is_free[place] = 1;
  }
  const auto num_dead = std::ranges::count(map.points(), false, &MapPoint::alive);
  return static_cast<std::size_t>(num_dead) == places.size();
}

}  // namespace mono3d::tracking
