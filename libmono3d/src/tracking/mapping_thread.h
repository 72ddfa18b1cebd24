// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <thread>
#include <vector>

#include "tracking/map/map.h"
#include "tracking/priority_mutex.h"

namespace mono3d::tracking {

// What the mapping thread does; both are called with the map taken.
struct MappingWork {
  std::function<void(KeyframeId, MappingLock&)> map_keyframe;
  // Adjusts the whole map, until it is done (true) or interrupted (false: to be called again).
  std::function<bool(MappingLock&)> adjust_all;
};

// Keyframes in the order in which they came, one after the other; once none waits, the adjustment
// of everything where one is due. One that a keyframe has interrupted is gone on with later, so
// that while they keep coming it takes no more than a tenth of the time: of a large map it comes to
// no end between two keyframes. All calls are made with the map locked by tracking.
class MappingThread {
 public:
  explicit MappingThread(MappingWork work);
  // Leaves undone what has not begun.
  ~MappingThread();
  MappingThread(const MappingThread&) = delete;
  MappingThread& operator=(const MappingThread&) = delete;

  PriorityMutex& mutex() { return mutex_; }

  // Interrupts the adjustment that is under way.
  void Add(KeyframeId keyframe);
  // While too many keyframes wait. Throws what the work has thrown.
  void WaitForRoom(TrackingLock& lock);
  // Until all is done. Throws what the work has thrown.
  void Wait(TrackingLock& lock);

  // Until the work that has begun is over, an adjustment of everything before it is done; nothing
  // new begins before Resume. Throws what the work has thrown.
  void Pause(TrackingLock& lock);
  void Resume();
  // What has not begun, for the archives of image/state_archive.h; paused.
  template <typename Archive>
  void ExchangeState(Archive& archive) {
    std::vector<KeyframeId> waiting(waiting_.begin(), waiting_.end());
    archive.List(waiting, [&](KeyframeId& keyframe) { archive.Index(keyframe); });
    waiting_ = {waiting.begin(), waiting.end()};
    archive.Number(is_adjustment_due_);
  }
  const std::deque<KeyframeId>& waiting() const { return waiting_; }

  // From within the work.
  void RequestAdjustment() { is_adjustment_due_ = true; }
  // Keyframes that wait get numbers so much higher.
  void Renumber(KeyframeId added);

 private:
  void Run();
  bool HasWork() const;
  void RunNext(MappingLock& lock);
  void Rethrow();

  MappingWork work_;
  PriorityMutex mutex_;
  // All of these are touched with the map taken.
  std::deque<KeyframeId> waiting_;
  bool is_busy_ = false;
  bool is_adjustment_due_ = false;
  double adjustment_rests_until_ms_ = 0;  // WallClockMs
  int num_waiting_for_all_ = 0;           // calls of Wait
  bool is_ending_ = false;
  bool is_paused_ = false;
  std::exception_ptr error_;
  std::condition_variable_any changed_;
  std::atomic<bool> is_interrupted_ = false;
  std::thread thread_;
};

}  // namespace mono3d::tracking
