// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/position_feed.h"

#include <optional>
#include <vector>

#include "mono3d/pipeline/georeferencing.h"

namespace mono3d {
namespace {

// Before, a map is too short for its drift to be more than positions err by.
constexpr std::size_t kFirstKeyframes = 40;

void EraseOthers(int map_id, std::vector<TrajectoryEntry>& entries) {
  std::erase_if(entries, [&](const TrajectoryEntry& entry) { return entry.map_id != map_id; });
}

}  // namespace

bool PositionFeed::IsDue(int map_id, std::size_t num_keyframes) const {
  const auto due = due_at_.find(map_id);
  return num_keyframes >= (due == due_at_.end() ? kFirstKeyframes : due->second);
}

void PositionFeed::Give(int map_id, std::size_t num_keyframes, Tracker& tracker) {
  due_at_[map_id] = num_keyframes + num_keyframes / 2;
  MapReconstruction map;
  map.map_id = map_id;
  map.trajectory = tracker.Trajectory();
  map.keyframes = tracker.KeyframeTrajectory();
  EraseOthers(map_id, map.trajectory);
  EraseOthers(map_id, map.keyframes);
  if (positions_.track.clock == PositionClock::kImages) map.sparse = tracker.Sparse(map_id);
  const std::optional<CameraPositions> told = PositionsToFollow(map, positions_);
  if (told) tracker.FollowPositions(*told);
}

}  // namespace mono3d
