// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/paced_source.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <thread>
#include <utility>

#include "mono3d/core/log.h"
#include "mono3d/core/timing.h"

namespace mono3d {
namespace {

// So soon a stop is noticed; a person does not notice it.
constexpr double kMaxSleep_s = 0.05;
// A camera that pauses for longer was switched off meanwhile, or its clock was set.
constexpr double kMaxWait_s = 10;

double PacedClock_s() { return 1e-3 * WallClockMs(); }

}  // namespace

PacedSource::PacedSource(std::unique_ptr<FrameSource> source, const std::atomic<bool>* stop)
    : ForwardingSource(std::move(source)), stop_(stop) {}

std::optional<Frame> PacedSource::Next() {
  if (IsStopped()) return std::nullopt;
  std::optional<Frame> frame = ForwardingSource::Next();
  if (!frame) return std::nullopt;
  if (!start_s_) start_s_ = PacedClock_s() - frame->timestamp_s;
  const double gap_s = *start_s_ + frame->timestamp_s - PacedClock_s();
  if (gap_s > kMaxWait_s) {
    Log(LogLevel::kWarning, frame->name + ": a gap of " + std::to_string(std::llround(gap_s)) +
                                " s in the time stamps is not waited for");
    *start_s_ -= gap_s;
  }
  const double due_s = *start_s_ + frame->timestamp_s;
  for (double wait_s = due_s - PacedClock_s(); wait_s > 0; wait_s = due_s - PacedClock_s()) {
    if (IsStopped()) return std::nullopt;
    std::this_thread::sleep_for(std::chrono::duration<double>(std::min(wait_s, kMaxSleep_s)));
  }
  return frame;
}

}  // namespace mono3d
