// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The part of OrbTracker that is about its thread for mapping. Everything it has is touched by the
// thread that holds the lock; what Track does in the foreground and the mapping in the background
// are the functions of the sequential mode.

#include "tracking/map/keyframe_handover.h"
#include "tracking/mapping/local_mapping.h"
#include "tracking/optimisation/map_adjustment.h"
#include "tracking/orb_tracker.h"

namespace mono3d::tracking {

// Both work on the map in use: it is left only when all of it is mapped.
MappingWork OrbTracker::BackgroundWork() {
  const auto map_keyframe = [this](KeyframeId keyframe, MappingLock& lock) {
    MapKeyframeInto(map(), keyframe, options_.mapping, times_, lock);
    PublishPoses();
    lock.Yield();
    const bool has_moved = RecognisePlace(keyframe, lock);
    if (FollowModel(lock) || has_moved) PublishPoses();
  };
  const auto adjust_all = [this](MappingLock& lock) {
    const ScopedStageTimer timer(times_, "tracking/full_bundle_adjustment");
    const bool is_done = AdjustAllAndScales(map(), lock);
    PublishPoses();
    return is_done;
  };
  return {map_keyframe, adjust_all};
}

// Null where nobody shares the map.
std::unique_ptr<TrackingLock> OrbTracker::Lock() const {
  return mapping_ ? std::make_unique<TrackingLock>(mapping_->mutex()) : nullptr;
}

// Adds to a result what the mapping has brought since the last one. The pose in it is by the map as
// it is now.
void OrbTracker::HandOver(TrackingResult& result) {
  if (!has_map_) return;
  for (Keyframe& keyframe : TakeFinalised(map(), false)) {
    result.finalised_keyframes.push_back(std::move(keyframe));
  }
}

void OrbTracker::WaitForMapping() {
  const std::unique_ptr<TrackingLock> lock = Lock();
  if (mapping_) mapping_->Wait(*lock);
  MappingLock alone;  // nothing is mapped now
  if (has_map_ && FollowModel(alone)) PublishPoses();
}

}  // namespace mono3d::tracking
