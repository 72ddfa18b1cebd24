// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/map_turn.h"

namespace mono3d::tracking {

void MapTurns::TakeForTracking() {
  std::unique_lock lock(mutex_);
  ++num_tracking_waits_;
  given_.wait(lock, [&] { return !is_taken_; });
  --num_tracking_waits_;
  is_taken_ = true;
}

void MapTurns::TakeForMapping() {
  std::unique_lock lock(mutex_);
  given_.wait(lock, [&] { return !is_taken_ && num_tracking_waits_ == 0; });
  is_taken_ = true;
}

void MapTurns::Give() {
  {
    const std::lock_guard lock(mutex_);
    is_taken_ = false;
  }
  given_.notify_all();
}

}  // namespace mono3d::tracking
