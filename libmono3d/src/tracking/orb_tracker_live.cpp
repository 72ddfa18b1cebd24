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
    turn.Breathe();
    if (RecognisePlace(keyframe, turn)) is_correction_due_ = true;
    if (FollowModel(turn)) is_correction_due_ = true;
  };
  const auto adjust_all = [this](MappingTurn& turn) {
    const ScopedStageTimer timer(times_, "tracking/full_bundle_adjustment");
    const bool is_done = AdjustMerged(map(), turn);
    if (is_done) is_correction_due_ = true;
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
  if (maps_.empty()) return;
  if (is_correction_due_) result.corrections = CorrectionsOf(map());
  is_correction_due_ = false;
  if (!has_map_) return;
  for (Keyframe& keyframe : TakeFinalised(map(), false, next_keyframe_id_)) {
    result.finalised_keyframes.push_back(std::move(keyframe));
  }
}

std::vector<KeyframeCorrection> OrbTracker::WaitForMapping() {
  const std::unique_ptr<TrackingTurn> turn = TakeTurn();
  if (mapping_) mapping_->Wait(*turn);
  MappingTurn alone;  // nothing is mapped now
  if (has_map_ && FollowModel(alone)) is_correction_due_ = true;
  TrackingResult result;
  if (is_correction_due_ && !maps_.empty()) result.corrections = CorrectionsOf(map());
  is_correction_due_ = false;
  return std::move(result.corrections);
}

}  // namespace mono3d::tracking
