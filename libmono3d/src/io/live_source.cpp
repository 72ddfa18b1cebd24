// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/live_source.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

#include "io/live_queue.h"
#include "mono3d/core/timing.h"

namespace mono3d {
namespace {

double Now_s() { return 1e-3 * WallClockMs(); }

}  // namespace

struct LiveSource::State {
  std::unique_ptr<FrameSource> source;  // the thread's own, but what never changes
  std::optional<std::int64_t> num_frames;

  mutable std::mutex mutex;
  std::condition_variable changed;
  LiveQueue queue;
  double start_s = 0;  // when a frame with time stamp 0 would have been due
  bool has_started = false;
  bool has_ended = false;  // no more frames will come
  bool is_ending = false;  // nobody wants more
  std::int64_t num_skipped = 0;
  std::exception_ptr error;
  std::thread thread;

  State(std::unique_ptr<FrameSource> from, double max_delay_s)
      : source(std::move(from)), num_frames(source->num_frames()), queue(max_delay_s) {}

  void Run();
  bool Play(Frame frame);
};

void LiveSource::State::Run() {
  std::exception_ptr thrown;
  try {
    while (true) {
      std::optional<Frame> frame = source->Next();
      const std::int64_t skipped = source->num_skipped();
      {
        const std::lock_guard lock(mutex);
        num_skipped = skipped;
      }
      if (!frame || !Play(*std::move(frame))) break;
    }
  } catch (...) {
    thrown = std::current_exception();
  }
  const std::lock_guard lock(mutex);
  error = std::move(thrown);  // who takes it has it alone
  has_ended = true;
  changed.notify_all();
}

// Hands the frame over when it is due. False when nobody wants it any more.
bool LiveSource::State::Play(Frame frame) {
  std::unique_lock lock(mutex);
  if (!has_started) start_s = Now_s() - frame.timestamp_s;
  has_started = true;
  constexpr double kLongest_s = 1e6;  // what the clock can count to with certainty
  const std::chrono::duration<double> wait(
      std::min(kLongest_s, start_s + frame.timestamp_s - Now_s()));
  if (wait.count() > 0) changed.wait_for(lock, wait, [&] { return is_ending; });
  if (is_ending) return false;
  queue.Add(std::move(frame), Now_s());
  changed.notify_all();
  return true;
}

LiveSource::LiveSource(std::unique_ptr<FrameSource> source, const LiveSourceOptions& options) {
  options.Validate();
  state_ = std::make_unique<State>(std::move(source), options.max_delay_s);
  state_->thread = std::thread([state = state_.get()] { state->Run(); });
}

LiveSource::~LiveSource() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->is_ending = true;
  }
  state_->changed.notify_all();
  state_->thread.join();
}

std::optional<Frame> LiveSource::Next() {
  std::unique_lock lock(state_->mutex);
  state_->changed.wait(lock, [&] { return !state_->queue.empty() || state_->has_ended; });
  std::optional<Frame> frame = state_->queue.Take(Now_s());
  if (!frame && state_->error) std::rethrow_exception(std::exchange(state_->error, nullptr));
  return frame;
}

std::optional<std::int64_t> LiveSource::num_frames() const { return state_->num_frames; }

std::int64_t LiveSource::num_skipped() const {
  const std::lock_guard lock(state_->mutex);
  return state_->num_skipped;
}

const CameraModel& LiveSource::camera() const { return state_->source->camera(); }

std::int64_t LiveSource::num_dropped() const {
  const std::lock_guard lock(state_->mutex);
  return state_->queue.num_dropped();
}

double LiveSource::Latency_s(const Frame& frame) const {
  const std::lock_guard lock(state_->mutex);
  return Now_s() - (state_->start_s + frame.timestamp_s);
}

void LiveSourceOptions::Visit(OptionVisitor& visit) {
  visit("max_delay_s", max_delay_s, "time that a frame waits to be tracked; then it is dropped");
}

void LiveSourceOptions::Validate() const {
  RequireOption(max_delay_s >= 0, "live.max_delay_s", "0 or more", max_delay_s);
}

}  // namespace mono3d
