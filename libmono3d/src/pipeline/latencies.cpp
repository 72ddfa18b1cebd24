// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/latencies.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <utility>

#include "pipeline/clock.h"

namespace mono3d {

LiveStatistics SummariseLatencies(std::vector<double> latencies_ms, double elapsed_s) {
  LiveStatistics statistics;
  if (latencies_ms.empty()) return statistics;
  std::ranges::sort(latencies_ms);
  const std::size_t count = latencies_ms.size();
  if (elapsed_s > 0) statistics.frames_per_s = static_cast<double>(count) / elapsed_s;
  for (const double latency_ms : latencies_ms) {
    statistics.mean_latency_ms += latency_ms / static_cast<double>(count);
  }
  statistics.p95_latency_ms = latencies_ms[count - 1 - (count - 1) / 20];
  statistics.max_latency_ms = latencies_ms.back();
  return statistics;
}

void FrameLatencies::Pushed(std::int64_t frame_index) {
  const std::lock_guard lock(mutex_);
  const double now_s = Clock_s();
  if (first_s_ < 0) first_s_ = now_s;
  pushed_s_[frame_index] = now_s;
}

void FrameLatencies::Tracked(std::int64_t frame_index) {
  const std::lock_guard lock(mutex_);
  const auto found = pushed_s_.find(frame_index);
  if (found == pushed_s_.end()) return;
  last_s_ = Clock_s();
  latencies_ms_.push_back(1e3 * (last_s_ - found->second));
  pushed_s_.erase(pushed_s_.begin(), std::next(found));
}

LiveStatistics FrameLatencies::Statistics() const {
  const std::lock_guard lock(mutex_);
  return SummariseLatencies(latencies_ms_, last_s_ - first_s_);
}

}  // namespace mono3d
