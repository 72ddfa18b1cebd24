// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/positions/position_follower.h"

#include <utility>

namespace mono3d::tracking {
namespace {

constexpr double kMaxShareOfCore = 0.1;

}  // namespace

bool PositionFollower::Follow(Map& map, const Frames& frames, std::size_t num_open,
                              MappingLock& lock) {
  DropBackground();
  std::optional<CameraPositions> positions = positions_.TakeDue(map.id());
  if (!positions) return false;
  const std::optional<PositionFit> fit = FollowPositions(map, frames(), num_open, *positions, lock);
  if (!fit) return false;
  positions_.SetFit(*fit, positions->S_metric_map);
  return true;
}

bool PositionFollower::FollowInBackground(Map& map, const Frames& frames, std::size_t num_open) {
  if (!background_) {
    background_ = std::make_unique<BackgroundTask<Task, Task>>(
        "the path does not follow its positions so far",
        [](Task task) {
          task.fit = FitPath(task.of_map);
          return task;
        },
        kMaxShareOfCore);
  }
  if (TakeFitted(map)) return true;
  if (!background_->IsFree()) return false;
  std::optional<CameraPositions> positions = positions_.TakeDue(map.id());
  if (!positions) return false;
  std::optional<PathOfMap> of_map = FindPath(map, frames(), num_open, *positions);
  if (!of_map) return false;
  map_in_background_ = map.id();
  background_->Begin({map.id(), num_moves_, *std::move(of_map), *std::move(positions), {}});
  return false;
}

bool PositionFollower::TakeFitted(Map& map) {
  std::optional<Task> task = background_->Take();
  if (!task) return false;
  map_in_background_.reset();
  if (!task->fit.is_found) return false;
  if (task->map_id != map.id() || task->num_moves != num_moves_) {
    positions_.SetDue(task->map_id);
    return false;
  }
  const PositionFit fit = MoveOntoPath(task->of_map, task->fit, map, task->positions);
  positions_.SetFit(fit, task->positions.S_metric_map);
  return true;
}

void PositionFollower::DropBackground() {
  background_.reset();
  if (map_in_background_) positions_.SetDue(*std::exchange(map_in_background_, std::nullopt));
}

}  // namespace mono3d::tracking
