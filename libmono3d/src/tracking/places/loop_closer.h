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

// What has become of the map in use when a new keyframe showed a known place.
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

  // The keyframe, of the map in use, joins the index. Nothing where the map has not moved. Where
  // others share the map, the adjustment of everything is left for later.
  std::optional<PlaceClosure> Close(KeyframeId keyframe, MappingLock& lock) const;

 private:
  bool CloseLoopIfAny(KeyframeId keyframe, MappingLock& lock) const;
  std::optional<NumberShift> JoinIfKnown(KeyframeId keyframe, MappingLock& lock) const;

  TrackerOptions options_;
  StageTimes* times_;
  Atlas* atlas_;
};

}  // namespace mono3d::tracking
