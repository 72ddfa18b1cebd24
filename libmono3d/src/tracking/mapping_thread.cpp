// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/mapping_thread.h"

#include <chrono>
#include <utility>

#include "mono3d/core/timing.h"

namespace mono3d::tracking {
namespace {

// More keyframes than this never wait: tracking would go on over ground without points.
constexpr std::size_t kMaxWaiting = 2;
// Of one core, of adjustments that are interrupted.
constexpr double kMaxShareOfInterrupted = 0.1;
constexpr auto kRestPollInterval = std::chrono::milliseconds(50);

}  // namespace

MappingThread::MappingThread(MappingWork work) : work_(std::move(work)) {
  thread_ = std::thread([this] { Run(); });
}

MappingThread::~MappingThread() {
  {
    const TrackingLock lock(mutex_);
    is_ending_ = true;
    is_interrupted_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void MappingThread::Add(KeyframeId keyframe) {
  waiting_.push_back(keyframe);
  is_interrupted_ = true;
  changed_.notify_all();
}

void MappingThread::WaitForRoom(TrackingLock& lock) {
  changed_.wait(lock, [&] { return waiting_.size() <= kMaxWaiting || error_ != nullptr; });
  Rethrow();
}

void MappingThread::Wait(TrackingLock& lock) {
  ++num_waiting_for_all_;  // then nothing rests
  changed_.notify_all();
  changed_.wait(lock, [&] {
    return (waiting_.empty() && !is_busy_ && !is_adjustment_due_) || error_ != nullptr;
  });
  --num_waiting_for_all_;
  Rethrow();
}

void MappingThread::Pause(TrackingLock& lock) {
  is_paused_ = true;
  is_interrupted_ = true;
  changed_.wait(lock, [&] { return !is_busy_ || error_ != nullptr; });
  if (error_ != nullptr) is_paused_ = false;
  Rethrow();
}

void MappingThread::Resume() {
  is_paused_ = false;
  changed_.notify_all();
}

void MappingThread::Renumber(KeyframeId added) {
  for (KeyframeId& keyframe : waiting_) keyframe += added;
}

void MappingThread::Rethrow() {
  if (error_ != nullptr) std::rethrow_exception(error_);
}

bool MappingThread::HasWork() const {
  if (error_ != nullptr || is_paused_) return false;
  if (!waiting_.empty()) return true;
  return is_adjustment_due_ &&
         (num_waiting_for_all_ > 0 || WallClockMs() >= adjustment_rests_until_ms_);
}

void MappingThread::Run() {
  MappingLock lock(mutex_, is_interrupted_);
  while (true) {
    while (!is_ending_ && !HasWork()) {
      if (is_adjustment_due_) {
        changed_.wait_for(lock, kRestPollInterval);
      } else {
        changed_.wait(lock);
      }
    }
    if (is_ending_) return;
    is_busy_ = true;
    try {
      RunNext(lock);
    } catch (...) {
      error_ = std::current_exception();
    }
    is_busy_ = false;
    changed_.notify_all();
  }
}

void MappingThread::RunNext(MappingLock& lock) {
  if (!waiting_.empty()) {
    const KeyframeId keyframe = waiting_.front();
    waiting_.pop_front();
    is_interrupted_ = !waiting_.empty() || is_ending_;
    changed_.notify_all();  // there is room
    work_.map_keyframe(keyframe, lock);
    return;
  }
  is_interrupted_ = is_ending_;
  const double start_ms = ThreadCpuMs();
  is_adjustment_due_ = !work_.adjust_all(lock);
  if (!is_adjustment_due_) return;
  adjustment_rests_until_ms_ = WallClockMs() + (ThreadCpuMs() - start_ms) / kMaxShareOfInterrupted;
}

}  // namespace mono3d::tracking
