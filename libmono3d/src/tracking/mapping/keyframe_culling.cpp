// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/mapping/keyframe_culling.h"

#include <algorithm>
#include <cstddef>

namespace mono3d::tracking {
namespace {

// Do three others have as fine a look at the point of a feature as its keyframe, or finer?
bool IsSeenByOthers(const Map& map, KeyframeId id, std::size_t feature) {
  const View& view = map.keyframe(id).view;
  int num_others = 0;
  for (const Observation& observation : map.point(*view.points[feature]).observations) {
    if (observation.keyframe == id) continue;
    const View& other = map.keyframe(observation.keyframe).view;
    const int level = other.features[observation.feature].level;
    num_others += level <= view.features[feature].level + 1 ? 1 : 0;
    if (num_others >= 3) return true;
  }
  return false;
}

bool IsRedundant(const Map& map, KeyframeId id, double max_share) {
  const View& view = map.keyframe(id).view;
  const auto num_points = static_cast<double>(std::count_if(
      view.points.begin(), view.points.end(), [](const auto& point) { return point.has_value(); }));
  // Most keyframes are out of the question after a few points.
  int num_missed = 0;
  for (std::size_t feature = 0; feature < view.points.size(); ++feature) {
    if (!view.points[feature] || IsSeenByOthers(map, id, feature)) continue;
    ++num_missed;
    if (num_points - num_missed <= max_share * num_points) return false;
  }
  return num_points > 0;
}

// The keyframe of a lower number that shares most with one, else the next lower one.
KeyframeId AnchorOf(const Map& map, KeyframeId id) {
  for (const Covisible& other : map.CovisibleKeyframes(id)) {
    if (other.keyframe < id) return other.keyframe;
  }
  KeyframeId anchor = id - 1;
  while (!map.keyframe(anchor).alive) --anchor;
  return anchor;
}

}  // namespace

void CullKeyframes(Map& map, KeyframeId keyframe, const LocalMappingOptions& options) {
  for (const Covisible& neighbour : map.CovisibleKeyframes(keyframe)) {
    // The first one defines the world; those that have not finalised are still awaited.
    if (neighbour.keyframe == 0 || !map.keyframe(neighbour.keyframe).is_finalised) continue;
    if (!IsRedundant(map, neighbour.keyframe, options.max_redundant_share)) continue;
    map.RemoveKeyframe(neighbour.keyframe, AnchorOf(map, neighbour.keyframe));
  }
}

}  // namespace mono3d::tracking
