// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/position_feed.h"

#include <optional>
#include <vector>

namespace mono3d {
namespace {

// Before, a map is too short for its drift to be more than positions err by.
constexpr std::size_t kFirstKeyframes = 40;
constexpr double kMaxShareOfCore = 0.05;  // live

void EraseOthers(int map_id, std::vector<TrajectoryEntry>& entries) {
  std::erase_if(entries, [&](const TrajectoryEntry& entry) { return entry.map_id != map_id; });
}

}  // namespace

void PositionFeed::SetTrack(PositionTrack track) {
  const std::lock_guard lock(mutex_);
  positions_.track = std::move(track);
}

std::shared_ptr<const PlaceOfMap> PositionFeed::place() const {
  const std::lock_guard lock(mutex_);
  return place_;
}

PipelinePositions PositionFeed::Positions() const {
  const std::lock_guard lock(mutex_);
  return positions_;
}

void PositionFeed::NotePlace(int map_id, GeoreferenceResult result) {
  if (!result.georeference) return;
  auto place =
      std::make_shared<const PlaceOfMap>(PlaceOfMap{map_id, *std::move(result.georeference)});
  const std::lock_guard lock(mutex_);
  place_ = std::move(place);
}

MapReconstruction PositionFeed::MapSoFar(int map_id, const PositionTrack& track,
                                         const Tracker& tracker) const {
  MapReconstruction map;
  map.map_id = map_id;
  map.trajectory = tracker.Trajectory();
  map.keyframes = tracker.KeyframeTrajectory();
  EraseOthers(map_id, map.trajectory);
  EraseOthers(map_id, map.keyframes);
  if (track.clock == PositionClock::kImages) map.sparse = tracker.Sparse(map_id);
  return map;
}

bool PositionFeed::IsDue(int map_id, std::size_t num_keyframes) const {
  const auto due = due_at_.find(map_id);
  return num_keyframes >= (due == due_at_.end() ? kFirstKeyframes : due->second);
}

void PositionFeed::Give(int map_id, std::size_t num_keyframes, Tracker& tracker) {
  if (is_live_) {
    GiveInBackground(map_id, num_keyframes, tracker);
  } else if (IsDue(map_id, num_keyframes)) {
    GiveNow(map_id, num_keyframes, tracker);
  } else if (!has_looked_ && !due_at_.empty()) {
    // A run that goes on knew the place; nothing is to be followed before it was.
    has_looked_ = true;
    const PipelinePositions positions = Positions();
    NotePlace(map_id, FindPlaceOnEarth(MapSoFar(map_id, positions.track, tracker), positions));
  }
}

void PositionFeed::GiveNow(int map_id, std::size_t num_keyframes, Tracker& tracker) {
  has_looked_ = true;
  due_at_[map_id] = num_keyframes + num_keyframes / 2;
  const PipelinePositions positions = Positions();
  MapOnEarth found = FindMapOnEarth(MapSoFar(map_id, positions.track, tracker), positions);
  if (found.to_follow) tracker.FollowPositions(*found.to_follow);
  NotePlace(map_id, std::move(found.place));
}

// The tracker follows some keyframes later than those that were looked at.
void PositionFeed::GiveInBackground(int map_id, std::size_t num_keyframes, Tracker& tracker) {
  if (!background_) {
    background_ = std::make_unique<BackgroundTask<Task, Found>>(
        "no place on the earth so far",
        [](const Task& task) {
          return Found{task.map.map_id, FindMapOnEarth(task.map, task.positions)};
        },
        kMaxShareOfCore);
  }
  if (std::optional<Found> found = background_->Take()) {
    if (is_followed_ && found->on_earth.to_follow) {
      tracker.FollowPositions(*found->on_earth.to_follow);
    }
    NotePlace(found->map_id, std::move(found->on_earth.place));
  }
  if (!background_->IsFree()) return;
  is_followed_ = IsDue(map_id, num_keyframes);
  if (is_followed_) due_at_[map_id] = num_keyframes + num_keyframes / 2;
  Task task{{}, Positions()};
  task.map = MapSoFar(map_id, task.positions.track, tracker);
  background_->Begin(std::move(task));
}

}  // namespace mono3d
