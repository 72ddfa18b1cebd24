// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "mono3d/image/frame.h"

namespace mono3d {

// Frames that have come and wait to be taken, the oldest first. Those that have waited for longer
// than `max_delay_s` go, except the newest one.
class LiveQueue {
 public:
  explicit LiveQueue(double max_delay_s) : max_delay_s_(max_delay_s) {}

  void Add(Frame frame, double now_s);
  std::optional<Frame> Take(double now_s);
  bool empty() const { return waiting_.empty(); }
  std::int64_t num_dropped() const { return num_dropped_; }

 private:
  struct Waiting {
    Frame frame;
    double since_s = 0;
  };
  void DropOld(double now_s);

  double max_delay_s_;
  std::deque<Waiting> waiting_;
  std::int64_t num_dropped_ = 0;
};

}  // namespace mono3d
