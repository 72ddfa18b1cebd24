// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/priority_mutex.h"

namespace mono3d::tracking {

void PriorityMutex::LockForTracking() {
  std::unique_lock lock(mutex_);
  ++num_tracking_waits_;
  unlocked_.wait(lock, [&] { return !is_locked_; });
  --num_tracking_waits_;
  is_locked_ = true;
}

void PriorityMutex::LockForMapping() {
  std::unique_lock lock(mutex_);
  unlocked_.wait(lock, [&] { return !is_locked_ && num_tracking_waits_ == 0; });
  is_locked_ = true;
}

void PriorityMutex::Unlock() {
  {
    const std::lock_guard lock(mutex_);
    is_locked_ = false;
  }
  unlocked_.notify_all();
}

}  // namespace mono3d::tracking
