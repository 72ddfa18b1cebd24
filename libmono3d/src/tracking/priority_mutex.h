// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <atomic>
#include <condition_variable>
#include <mutex>

namespace mono3d::tracking {

// Guards the map: one thread holds it at a time, and tracking comes before mapping, so that a frame
// waits for one short step of the mapping at most.
class PriorityMutex {
 public:
  void LockForTracking();
  void LockForMapping();
  void Unlock();

 private:
  std::mutex mutex_;
  std::condition_variable unlocked_;
  bool is_locked_ = false;
  int num_tracking_waits_ = 0;
};

// Tracking holds the map from construction to destruction; for std::condition_variable_any as well.
class TrackingLock {
 public:
  explicit TrackingLock(PriorityMutex& mutex) : mutex_(mutex) { lock(); }
  ~TrackingLock() { unlock(); }
  TrackingLock(const TrackingLock&) = delete;
  TrackingLock& operator=(const TrackingLock&) = delete;
  void lock() { mutex_.LockForTracking(); }
  void unlock() { mutex_.Unlock(); }

 private:
  PriorityMutex& mutex_;
};

// Mapping holds the map, and unlocks it between its steps and where it works on copies. Without a
// mutex no other thread shares the map, and all calls do nothing.
class MappingLock {
 public:
  MappingLock() = default;
  // `is_interrupted`: that the adjustment under way should come to its end.
  MappingLock(PriorityMutex& mutex, const std::atomic<bool>& is_interrupted)
      : mutex_(&mutex), is_interrupted_(&is_interrupted) {
    lock();
  }
  ~MappingLock() { unlock(); }
  MappingLock(const MappingLock&) = delete;
  MappingLock& operator=(const MappingLock&) = delete;
  void lock() {
    if (mutex_ != nullptr) mutex_->LockForMapping();
  }
  void unlock() {
    if (mutex_ != nullptr) mutex_->Unlock();
  }
  bool IsShared() const { return mutex_ != nullptr; }
  const std::atomic<bool>* is_interrupted() const { return is_interrupted_; }
  // Lets tracking come in, if it waits.
  void Yield() {
    unlock();
    lock();
  }

 private:
  PriorityMutex* mutex_ = nullptr;
  const std::atomic<bool>* is_interrupted_ = nullptr;
};

// Unlocks the map while the mapping works on copies.
class ScopedUnlock {
 public:
  explicit ScopedUnlock(MappingLock& lock) : lock_(lock) { lock_.unlock(); }
  ~ScopedUnlock() { lock_.lock(); }
  ScopedUnlock(const ScopedUnlock&) = delete;
  ScopedUnlock& operator=(const ScopedUnlock&) = delete;

 private:
  MappingLock& lock_;
};

}  // namespace mono3d::tracking
