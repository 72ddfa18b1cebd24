// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The part of OrbTracker that is about its thread for mapping. Everything it has is touched by the
// thread whose turn it is; what Track does in the foreground and the mapping in the background are
// the functions of the sequential mode.

#include "tracking/local_mapping.h"
#include "tracking/loop_closing.h"
#include "tracking/orb_tracker.h"

namespace mono3d::tracking {

// Both work on the map in use: it is left only when all of it is mapped.
MappingWork OrbTracker::BackgroundWork() {
  const auto map_keyframe = [this](KeyframeId keyframe, MappingTurn& turn) {
    MapKeyframeInto(map(), keyframe, options_.mapping, times_, turn);
    PublishPoses();
    turn.Breathe();
    const bool has_moved = RecognisePlace(keyframe, turn);
    if (FollowModel(turn) || has_moved) PublishPoses();
  };
  const auto adjust_all = [this](MappingTurn& turn) {
    const ScopedStageTimer timer(times_, "tracking/full_bundle_adjustment");
    const bool is_done = AdjustMerged(map(), turn);
    PublishPoses();
    return is_done;
  };
  return {map_keyframe, adjust_all};
}

// Null where nobody shares the map.
std::unique_ptr<TrackingTurn> OrbTracker::TakeTurn() const {
  return mapping_ ? std::make_unique<TrackingTurn>(mapping_->turns()) : nullptr;
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
  const std::unique_ptr<TrackingTurn> turn = TakeTurn();
  if (mapping_) mapping_->Wait(*turn);
  MappingTurn alone;  // nothing is mapped now
  if (has_map_ && FollowModel(alone)) PublishPoses();
}

}  // namespace mono3d::tracking
