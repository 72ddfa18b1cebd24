// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/places/loop_closer.h"

#include <cstddef>

#include "tracking/places/loop_closing.h"

namespace mono3d::tracking {

std::optional<PlaceClosure> LoopCloser::Close(KeyframeId keyframe, MappingLock& lock) const {
  const double scale_before = atlas_->map().keyframe(keyframe).scale;
  PlaceClosure closure;
  if (!CloseLoopIfAny(keyframe, lock)) {
    closure.shift = JoinIfKnown(keyframe, lock);
    if (!closure.shift) return std::nullopt;
    keyframe += closure.shift->keyframes;
  }
  closure.scale = atlas_->map().keyframe(keyframe).scale / scale_before;
  return closure;
}

bool LoopCloser::CloseLoopIfAny(KeyframeId keyframe, MappingLock& lock) const {
  Map& map = atlas_->map();
  std::optional<PlaceFound> loop;
  {
    const ScopedStageTimer timer(times_, "tracking/place_recognition");
    for (const KeyframeId id : map.TakeCulled()) atlas_->places().Remove(id);
    loop = FindLoop(map, atlas_->places(), keyframe, options_.seed);
    atlas_->AddPlace(keyframe);
  }
  if (!loop) return false;
  const ScopedStageTimer timer(times_, "tracking/loop_closing");
  CloseLoop(map, *loop, options_.mapping, lock);
  return true;
}

std::optional<NumberShift> LoopCloser::JoinIfKnown(KeyframeId keyframe, MappingLock& lock) const {
  for (std::size_t other = 0; other < atlas_->num_maps(); ++other) {
    Map& other_map = atlas_->map(other);
    if (other == atlas_->current() || other_map.keyframes().empty()) continue;
    std::optional<PlaceFound> place;
    {
      const ScopedStageTimer timer(times_, "tracking/place_recognition");
      place =
          FindInOtherMap(atlas_->map(), keyframe, other_map, atlas_->places(other), options_.seed);
    }
    if (!place) continue;
    const ScopedStageTimer timer(times_, "tracking/map_joining");
    return atlas_->JoinInto(other, *place, options_.mapping, lock);
  }
  return std::nullopt;
}

}  // namespace mono3d::tracking
