// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/core/timing.h"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <ctime>

namespace mono3d {

void StageTimes::Add(std::string_view stage, double wall_ms, double gpu_ms, double cpu_ms) {
  Add({.stage = std::string(stage),
       .num_calls = 1,
       .wall_ms = wall_ms,
       .gpu_ms = gpu_ms,
       .cpu_ms = cpu_ms});
}

void StageTimes::Add(const StageTime& time) {
  const std::lock_guard lock(mutex_);
  auto it = std::ranges::find(times_, time.stage, &StageTime::stage);
  if (it == times_.end()) it = times_.insert(times_.end(), StageTime{.stage = time.stage});
  it->num_calls += time.num_calls;
  it->wall_ms += time.wall_ms;
  it->gpu_ms += time.gpu_ms;
  it->cpu_ms += time.cpu_ms;
}

std::vector<StageTime> StageTimes::Snapshot() const {
  const std::lock_guard lock(mutex_);
  return times_;
}

ScopedStageTimer::ScopedStageTimer(StageTimes* times, std::string_view stage)
    : times_(times), stage_(stage), start_ms_(WallClockMs()), start_cpu_ms_(ThreadCpuMs()) {}

ScopedStageTimer::~ScopedStageTimer() {
  if (times_ == nullptr) return;
  times_->Add(stage_, WallClockMs() - start_ms_, 0, ThreadCpuMs() - start_cpu_ms_);
}

double WallClockMs() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double, std::milli>(now).count();
}

double ThreadCpuMs() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

double ProcessCpuMs() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto to_ms = [](const timeval& time) {
    return 1e3 * static_cast<double>(time.tv_sec) + 1e-3 * static_cast<double>(time.tv_usec);
  };
  return to_ms(usage.ru_utime) + to_ms(usage.ru_stime);
}

std::int64_t PeakMemoryBytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return std::int64_t{usage.ru_maxrss} * 1024;  // Linux counts in KiB
}

}  // namespace mono3d
