// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/core/timing.h"
#include "mono3d/tracking/tracker.h"
#include "tracking/map/map.h"
#include "tracking/priority_mutex.h"

namespace mono3d::tracking {

// All that happens once for each new keyframe: new points, fusion, culling, local bundle
// adjustment.
class LocalMapper {
 public:
  // `times` may be null, else it must outlive the mapper.
  LocalMapper(const LocalMappingOptions& options, StageTimes* times)
      : options_(options), times_(times) {}

  // Unlocks the map between the steps, and while the adjustment works on its copy.
  void MapKeyframe(Map& map, KeyframeId keyframe, MappingLock& lock) const;
  // The same without points known by direction only.
  void MapKnownDepths(Map& map, KeyframeId keyframe, MappingLock& lock) const;

 private:
  void AddPoints(Map& map, KeyframeId keyframe, MappingLock& lock) const;
  void Adjust(Map& map, KeyframeId keyframe, MappingLock& lock) const;

  LocalMappingOptions options_;
  StageTimes* times_;
};

}  // namespace mono3d::tracking
