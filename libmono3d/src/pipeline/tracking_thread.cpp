// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/tracking_thread.h"

#include <string>
#include <utility>

#include "mono3d/core/error.h"
#include "pipeline/clock.h"
#include "pipeline/latencies.h"

namespace mono3d {
TrackingThread::TrackingThread(const LiveOptions& options,
                               std::function<void(const Frame&)> process, FirstError& error)
    : process_(std::move(process)), error_(error), queue_(options) {
  thread_ = std::thread([this] { Run(); });
}

TrackingThread::~TrackingThread() {
  {
    const std::lock_guard lock(mutex_);
    is_aborted_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

PushResult TrackingThread::Push(Frame frame) {
  PushResult result;
  {
    const std::lock_guard lock(mutex_);
    RequireNext(frame);
    const double now_s = Clock_s();
    if (!latest_) first_s_ = now_s;
    latest_ = frame;
    latest_->bgr.release();
    result.dropped = queue_.Add(std::move(frame), now_s);
    result.num_waiting = static_cast<std::int64_t>(queue_.size());
  }
  changed_.notify_all();
  return result;
}

// What the tracker would refuse, said to the one who pushes it.
void TrackingThread::RequireNext(const Frame& frame) {
  if (is_ending_) throw Error("a frame came after the end");
  Validate(frame);
  if (!latest_) return;
  if (frame.camera != latest_->camera) {
    throw Error(ErrorParts{.what = "camera differs from that of the frames before",
                           .where = frame.name,
                           .expected = {},
                           .found = {}});
  }
  if (frame.index <= latest_->index || frame.timestamp_s < latest_->timestamp_s) {
    throw Error(ErrorParts{.what = "frames are not in the order of time",
                           .where = frame.name,
                           .expected = "one after frame " + std::to_string(latest_->index) +
                                       " at " + std::to_string(latest_->timestamp_s) + " s",
                           .found = "frame " + std::to_string(frame.index) + " at " +
                                    std::to_string(frame.timestamp_s) + " s"});
  }
}

void TrackingThread::End() {
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void TrackingThread::Run() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [&] { return is_aborted_ || is_ending_ || queue_.size() > 0; });
    if (is_aborted_) return;
    const std::optional<FrameQueue::Waiting> next = queue_.Take(Clock_s());
    if (!next) return;
    lock.unlock();
    try {
      process_(next->frame);
    } catch (...) {
      error_.Set(std::current_exception());
      return;
    }
    lock.lock();
    last_s_ = Clock_s();
    latencies_ms_.push_back(1e3 * (last_s_ - next->since_s));
  }
}

LiveStatistics TrackingThread::Statistics() const {
  std::vector<double> latencies_ms;
  double elapsed_s = 0;
  std::int64_t num_dropped = 0;
  {
    const std::lock_guard lock(mutex_);
    num_dropped = queue_.num_dropped();
    latencies_ms = latencies_ms_;
    elapsed_s = last_s_ - first_s_;
  }
  LiveStatistics statistics = SummariseLatencies(std::move(latencies_ms), elapsed_s);
  statistics.num_dropped_frames = num_dropped;
  return statistics;
}

}  // namespace mono3d
