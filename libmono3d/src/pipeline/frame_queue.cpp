// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/frame_queue.h"

#include <utility>

namespace mono3d {
namespace {

std::size_t ImageBytes(const Frame& frame) { return frame.bgr.total() * frame.bgr.elemSize(); }

}  // namespace

std::vector<std::int64_t> FrameQueue::Add(Frame frame, double now_s) {
  num_bytes_ += ImageBytes(frame);
  waiting_.push_back({std::move(frame), now_s});
  Drop(now_s);
  return std::exchange(dropped_, {});
}

std::optional<FrameQueue::Waiting> FrameQueue::Take(double now_s) {
  Drop(now_s);
  if (waiting_.empty()) return std::nullopt;
  Waiting first = std::move(waiting_.front());
  waiting_.pop_front();
  num_bytes_ -= ImageBytes(first.frame);
  return first;
}

void FrameQueue::Drop(double now_s) {
  const auto is_over = [&] {
    return now_s - waiting_.front().since_s > options_.max_delay_s ||
           static_cast<double>(num_bytes_) > 1e6 * options_.max_waiting_mb;
  };
  while (waiting_.size() > 1 && is_over()) {
    dropped_.push_back(waiting_.front().frame.index);
    num_bytes_ -= ImageBytes(waiting_.front().frame);
    waiting_.pop_front();
    ++num_dropped_;
  }
}

}  // namespace mono3d
