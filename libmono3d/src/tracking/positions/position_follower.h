// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "core/background_task.h"
#include "tracking/positions/map_positions.h"
#include "tracking/positions/position_following.h"

namespace mono3d::tracking {

// Has the maps of a tracker follow their positions: at once, or live, where a fit of some hundred
// keyframes takes a second for which no keyframe can wait, in the background. Used by one thread at
// a time.
class PositionFollower {
 public:
  void Set(const CameraPositions& positions) { positions_.Set(positions); }
  // All of the map was adjusted without them.
  void SetDue(int map_id) {
    NoteMoved();
    positions_.SetDue(map_id);
  }
  // More than the newest keyframes has moved, or keyframes have gone: what is fitted in the
  // background is of no use.
  void NoteMoved() { ++num_moves_; }
  bool Has(int map_id) const { return positions_.Has(map_id); }
  std::vector<PositionFit> Fits() const { return positions_.Fits(); }

  // The tracked frames of the map, by time.
  using Frames = std::function<std::vector<TrajectoryEntry>()>;
  // True when the map has moved. See FollowPositions; nothing where the map has followed already.
  bool Follow(Map& map, const Frames& frames, std::size_t num_open, MappingLock& lock);
  // The same some keyframes later, in one of the next calls. Where the map has moved otherwise
  // meanwhile, it is fitted again.
  bool FollowInBackground(Map& map, const Frames& frames, std::size_t num_open);

  template <typename Archive>
  void ExchangeState(Archive& archive) {
    positions_.ExchangeState(archive);
  }

 private:
  struct Task {
    int map_id = 0;
    std::int64_t num_moves = 0;  // as of then
    PathOfMap of_map;
    CameraPositions positions;
    PathFit fit;  // of the result
  };
  void DropBackground();
  bool TakeFitted(Map& map);

  MapPositions positions_;
  std::int64_t num_moves_ = 0;
  std::optional<int> map_in_background_;
  std::unique_ptr<BackgroundTask<Task, Task>> background_;
};

}  // namespace mono3d::tracking
