// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

// Sums over all calls of one stage. GPU time is 0 for a stage that runs on the CPU alone.
struct StageTime {
  std::string stage;  // "<module>/<stage>"
  std::int64_t num_calls = 0;
  double wall_ms = 0;
  double gpu_ms = 0;
  double cpu_ms = 0;  // of the threads that ran it, where that was measured
};

// Collects the times of the stages, in the order in which they first appear. Thread-safe.
class StageTimes {
 public:
  void Add(std::string_view stage, double wall_ms, double gpu_ms = 0, double cpu_ms = 0);
  // Of a part of the run that was made by another process.
  void Add(const StageTime& time);
  std::vector<StageTime> Snapshot() const;

 private:
  mutable std::mutex mutex_;
  std::vector<StageTime> times_;
};

// Adds the wall time of its own life, and what this thread computes meanwhile, to a stage; does
// nothing when `times` is null.
class ScopedStageTimer {
 public:
  ScopedStageTimer(StageTimes* times, std::string_view stage);
  ~ScopedStageTimer();
  ScopedStageTimer(const ScopedStageTimer&) = delete;
  ScopedStageTimer& operator=(const ScopedStageTimer&) = delete;

 private:
  StageTimes* times_;
  std::string stage_;
  double start_ms_;
  double start_cpu_ms_;
};

double WallClockMs();            // monotonic
double ThreadCpuMs();            // user and system time of the calling thread
double ProcessCpuMs();           // user and system time of all threads of this process
std::int64_t PeakMemoryBytes();  // largest resident set so far; 0 where the system does not say

}  // namespace mono3d
