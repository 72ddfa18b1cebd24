// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/live_queue.h"

#include <utility>

namespace mono3d {

void LiveQueue::Add(Frame frame, double now_s) {
  waiting_.push_back({std::move(frame), now_s});
  DropOld(now_s);
}

std::optional<Frame> LiveQueue::Take(double now_s) {
  DropOld(now_s);
  if (waiting_.empty()) return std::nullopt;
  Frame frame = std::move(waiting_.front().frame);
  waiting_.pop_front();
  return frame;
}

void LiveQueue::DropOld(double now_s) {
  while (waiting_.size() > 1 && now_s - waiting_.front().since_s > max_delay_s_) {
    waiting_.pop_front();
    ++num_dropped_;
  }
}

}  // namespace mono3d
