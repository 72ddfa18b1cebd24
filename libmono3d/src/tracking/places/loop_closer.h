// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <optional>

#include "mono3d/core/timing.h"
#include "mono3d/tracking/tracker.h"
#include "tracking/atlas.h"
#include "tracking/map/map.h"
#include "tracking/places/map_joining.h"
#include "tracking/priority_mutex.h"

namespace mono3d::tracking {

// How the map in use has changed because a new keyframe shows a known place.
struct PlaceClosure {
  double scale = 1;                  // by which lengths around the keyframe were multiplied
  std::optional<NumberShift> shift;  // where the map went into another one
};

// Closes loops and joins maps: looks in the index of the map in use, then in those of the others,
// for what a new keyframe shows.
class LoopCloser {
 public:
  // All must outlive it, but for `options`; `times` may be null.
  LoopCloser(const TrackerOptions& options, StageTimes* times, Atlas* atlas)
      : options_(options), times_(times), atlas_(atlas) {}

  // Adds the keyframe, of the map in use, to the index. Nothing where no known place was found.
  // Where another thread shares the map, its adjustment is left to the caller: AdjustAllAndScales.
  std::optional<PlaceClosure> Close(KeyframeId keyframe, MappingLock& lock) const;

 private:
  bool CloseLoopIfAny(KeyframeId keyframe, MappingLock& lock) const;
  std::optional<NumberShift> JoinIfKnown(KeyframeId keyframe, MappingLock& lock) const;

  TrackerOptions options_;
  StageTimes* times_;
  Atlas* atlas_;
};

}  // namespace mono3d::tracking
