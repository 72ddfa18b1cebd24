// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <vector>

#include "mono3d/pipeline/reconstruction.h"

namespace mono3d {

// Mean, 95th percentile and maximum; frames per second over `elapsed_s`. No dropped frames.
LiveStatistics SummariseLatencies(std::vector<double> latencies_ms, double elapsed_s);

// How long frames take from being pushed to being tracked. Any thread.
class FrameLatencies {
 public:
  void Pushed(std::int64_t frame_index);
  // Earlier frames that have not come are not waited for any more.
  void Tracked(std::int64_t frame_index);
  LiveStatistics Statistics() const;

 private:
  mutable std::mutex mutex_;
  std::map<std::int64_t, double> pushed_s_;
  std::vector<double> latencies_ms_;
  double first_s_ = -1, last_s_ = -1;
};

}  // namespace mono3d
