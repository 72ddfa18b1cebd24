// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "tracking/atlas.h"
#include "tracking/backlog.h"
#include "tracking/frame_refiner.h"
#include "tracking/priority_mutex.h"

namespace mono3d::tracking {

// Watches a map through a turn on the spot. Points known by direction only carry the track through
// it, but whether they carry the scale as well shows only when the camera moves on: then all that
// has seen the turn, the frames between the keyframes as well, is adjusted together, and the scale
// after the turn against that before it has a standard deviation by what the pixels say. Where that
// is small the map goes on; else it ends where directions were in the majority, and what came later
// belongs to another map. Until then no keyframe is final: none is culled, and none is handed on.
class TurnOnTheSpot {
 public:
  // Frames are kept up to `max_bytes`.
  explicit TurnOnTheSpot(std::size_t max_bytes) : frames_(max_bytes) {}

  bool IsPending() const { return start_.has_value(); }
  // To be undone with TakeBack.
  bool IsRefused() const { return is_refused_; }
  const Backlog& frames() const { return frames_; }  // since the start
  void Keep(const Frame& frame) { frames_.Add(frame); }
  // Nothing has been decided, and the track is lost, or the footage has ended: refused where the
  // map has gone beyond what holds its scale.
  void Abandon();
  void Renumber(const NumberShift& shift);

  // A keyframe was mapped.
  void Follow(Map& map, KeyframeId keyframe, const FrameRefiner& refiner, MappingLock& lock);
  // Decides by what is known now.
  void Judge(Map& map, const FrameRefiner& refiner, MappingLock& lock);

  // Takes the keyframes and frames of the map in use away that came after its scale was held.
  // Returns the frames, to be tracked anew.
  std::vector<Frame> TakeBack(Atlas& atlas, FrameRefiner& refiner);
  // For the archives of image/state_archive.h; of a tracker with that atlas.
  template <typename Archive>
  void ExchangeState(Archive& archive, const Atlas& atlas);

 private:
  static bool CanBeTakenBack(const Atlas& atlas, KeyframeId cut);
  void End();

  std::optional<KeyframeId> start_;  // the first with many directions
  std::optional<KeyframeId> cut_;    // the first where they are the majority
  bool is_refused_ = false;
  Backlog frames_;  // since the start
};

}  // namespace mono3d::tracking
