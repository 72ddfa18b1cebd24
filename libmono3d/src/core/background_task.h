// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <algorithm>
#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "mono3d/core/log.h"
#include "mono3d/core/thread_priority.h"
#include "mono3d/core/timing.h"

namespace mono3d {

// Work that a live run does not wait for: one piece at a time, in a thread of its own of low
// priority, which rests in between. The calls come from one thread at a time.
template <typename Task, typename Result>
class BackgroundTask {
 public:
  // `what` names the work where it throws: there is no result then, and the next piece may be
  // begun. So much of one core is taken at most, in processor time.
  BackgroundTask(std::string what, std::function<Result(Task)> work, double max_share_of_core)
      : what_(std::move(what)),
        work_(std::move(work)),
        max_share_of_core_(max_share_of_core),
        thread_([this] { Run(); }) {}
  // Ends after the work in hand.
  ~BackgroundTask() {
    {
      const std::lock_guard lock(mutex_);
      is_ending_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }
  BackgroundTask(const BackgroundTask&) = delete;
  BackgroundTask& operator=(const BackgroundTask&) = delete;

  // Nothing is worked at, no result waits to be taken, and it has rested.
  bool IsFree() const {
    const std::lock_guard lock(mutex_);
    return !is_busy_ && !result_ && WallClockMs() >= free_from_ms_;
  }
  // When it is free.
  void Begin(Task task) {
    {
      const std::lock_guard lock(mutex_);
      is_busy_ = true;
      task_.emplace(std::move(task));
    }
    changed_.notify_all();
  }
  // Once; nothing while it is worked at.
  std::optional<Result> Take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(result_, std::nullopt);
  }

 private:
  void Run() {
    LowerThreadPriority(ThreadPriority::kTenth);
    std::unique_lock lock(mutex_);
    while (true) {
      changed_.wait(lock, [&] { return is_ending_ || task_.has_value(); });
      if (is_ending_) return;
      Task task = *std::exchange(task_, std::nullopt);
      lock.unlock();
      const double start_ms = WallClockMs();
      const double start_cpu_ms = ThreadCpuMs();
      std::optional<Result> result;
      try {
        result.emplace(work_(std::move(task)));
      } catch (const std::exception& error) {
        Log(LogLevel::kDebug, what_ + ": " + error.what());
      }
      lock.lock();
      free_from_ms_ = start_ms + (ThreadCpuMs() - start_cpu_ms) / max_share_of_core_;
      result_ = std::move(result);
      is_busy_ = false;
    }
  }

  std::string what_;
  std::function<Result(Task)> work_;
  double max_share_of_core_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<Task> task_;
  std::optional<Result> result_;
  bool is_busy_ = false;
  bool is_ending_ = false;
  double free_from_ms_ = 0;  // WallClockMs
  std::thread thread_;       // uses the rest
};

}  // namespace mono3d
