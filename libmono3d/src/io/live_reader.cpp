// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/live_reader.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/core/timing.h"

namespace mono3d {
namespace {

// Images that wait to be fetched, a quarter of a second of a usual camera: what is fetched goes to
// the pipeline at once, which has a queue of its own and counts what it drops.
constexpr std::size_t kMaxWaiting = 8;
// So soon a stop is noticed.
constexpr auto kPoll = std::chrono::milliseconds(50);
// Waits between attempts double from the first to the last: a camera that lost its radio link is
// back at once, and one that starts anew is not overrun.
constexpr double kFirstWait_s = 0.5;
constexpr double kLastWait_s = 8;

double ReaderClock_s() { return 1e-3 * WallClockMs(); }

std::string Seconds(double seconds) { return std::to_string(std::llround(seconds)) + " s"; }

}  // namespace

LiveReader::LiveReader(LiveConnector connect, std::string name, std::string shown,
                       const LiveInputOptions& options)
    : connect_(std::move(connect)),
      name_(std::move(name)),
      shown_(std::move(shown)),
      options_(options) {
  const double deadline_s = ReaderClock_s() + options_.open_timeout_s;
  connection_ = connect_(options_.open_timeout_s, is_cancelled_);
  while (size_.empty()) {
    const double left_s = std::max(0.0, deadline_s - ReaderClock_s());
    LiveRead read = connection_->Read(left_s);
    const bool is_image = read.kind == LiveRead::Kind::kImage;
    const bool may_go_on = is_image || (read.kind == LiveRead::Kind::kDamaged && left_s > 0);
    if (!may_go_on) {
      throw Error(
          ErrorParts{.what = "no image comes: see that the camera is on, and that ffplay shows it",
                     .where = shown_,
                     .expected = "an image within " + Seconds(options_.open_timeout_s),
                     .found = read.reason.empty() ? "damaged ones alone" : read.reason,
                     .code = ErrorCode::kIo});
    }
    if (!is_image) continue;
    size_ = read.bgr.size();
    Add(std::move(read), ReaderClock_s());
  }
  thread_ = std::thread([this] { Run(); });
}

LiveReader::~LiveReader() {
  is_cancelled_ = true;
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void LiveReader::Begin() {
  const std::lock_guard lock(mutex_);
  has_begun_ = true;
  report_ = {.end = report_.end};
  if (waiting_.empty()) return;
  start_s_ = waiting_.front().timestamp_s;
  waiting_.front().index = report_.num_images++;
  waiting_.front().timestamp_s = 0;
}

std::optional<SourceImage> LiveReader::Next(const std::atomic<bool>* stop) {
  std::unique_lock lock(mutex_);
  const auto is_stopped = [&] { return stop != nullptr && stop->load(); };
  const auto has_ended = [&] { return !report_.end.empty() || is_cancelled_ || is_stopped(); };
  while (waiting_.empty() && !has_ended()) changed_.wait_for(lock, kPoll);
  if (waiting_.empty() || is_stopped()) return std::nullopt;
  SourceImage image = std::move(waiting_.front());
  waiting_.pop_front();
  image.name = name_ + "#" + std::to_string(image.index);
  return image;
}

LiveInputReport LiveReader::Report() const {
  const std::lock_guard lock(mutex_);
  return report_;
}

void LiveReader::Run() {
  while (!is_cancelled_) {
    LiveRead read;
    try {
      read = connection_->Read(options_.read_timeout_s);
    } catch (const std::exception& error) {  // no memory, or OpenCV's
      read.reason = error.what();
    }
    if (is_cancelled_) return;
    switch (read.kind) {
      case LiveRead::Kind::kImage:
        Add(std::move(read), ReaderClock_s());
        break;
      case LiveRead::Kind::kDamaged: {
        const std::lock_guard lock(mutex_);
        ++report_.num_damaged;
        break;
      }
      case LiveRead::Kind::kEnded:
        SetEnd(read.reason);
        return;
      case LiveRead::Kind::kBroken:
        if (!Reconnect(read.reason)) return;
        break;
    }
  }
}

void LiveReader::Add(LiveRead read, double arrival_s) {
  const std::int64_t num_by_arrival = clock_.num_by_arrival();
  SourceImage image{0, clock_.Add(read.stamp_s, arrival_s), {}, std::move(read.bgr)};
  const double gap_s = arrival_s - last_arrival_s_;
  last_arrival_s_ = arrival_s;
  const bool is_after_break = std::exchange(is_after_break_, false);
  {
    const std::lock_guard lock(mutex_);
    if (is_after_break) report_.missed_s += gap_s;
    report_.num_by_arrival += clock_.num_by_arrival() - num_by_arrival;
    if (!has_begun_) {
      waiting_.clear();
    } else {
      if (report_.num_images == 0) start_s_ = image.timestamp_s;
      image.index = report_.num_images++;
      image.timestamp_s -= start_s_;
    }
    waiting_.push_back(std::move(image));
    if (waiting_.size() > kMaxWaiting) {
      waiting_.pop_front();
      ++report_.num_dropped;
    }
  }
  changed_.notify_all();
  if (is_after_break) {
    Log(LogLevel::kWarning, shown_ + ": connected again after " + Seconds(gap_s));
  }
}

// False: no more images come.
bool LiveReader::Reconnect(std::string reason) {
  const auto left_s = [&] { return last_arrival_s_ + options_.reconnect_s - ReaderClock_s(); };
  if (!is_after_break_ && options_.reconnect_s > 0) {
    Log(LogLevel::kWarning, shown_ + ": the connection is broken (" + reason +
                                "): connecting again, until there was no image for " +
                                Seconds(options_.reconnect_s));
  }
  // A connection that breaks before its first image is the same break.
  const bool is_first = !std::exchange(is_after_break_, true);
  connection_.reset();
  double wait_s = is_first ? kFirstWait_s : kLastWait_s;
  while (!is_cancelled_ && left_s() > 0) {
    Wait(std::min(wait_s, left_s()));
    wait_s = std::min(2 * wait_s, kLastWait_s);
    if (is_cancelled_ || left_s() <= 0) break;
    try {
      connection_ = connect_(std::min(options_.open_timeout_s, left_s()), is_cancelled_);
    } catch (const std::exception& error) {
      reason = error.what();
      continue;
    }
    clock_.ForgetStamps();
    const std::lock_guard lock(mutex_);
    ++report_.num_reconnects;
    return true;
  }
  if (is_cancelled_) return false;
  const bool is_asked_to_wait = options_.reconnect_s > 0;
  SetEnd(is_asked_to_wait ? "no image for " + Seconds(options_.reconnect_s) + ": " + reason
                          : reason);
  return false;
}

void LiveReader::Wait(double wait_s) {
  const double end_s = ReaderClock_s() + wait_s;
  while (!is_cancelled_ && ReaderClock_s() < end_s) {
    std::this_thread::sleep_for(std::min<std::chrono::duration<double>>(
        kPoll, std::chrono::duration<double>(std::max(0.0, end_s - ReaderClock_s()))));
  }
}

void LiveReader::SetEnd(const std::string& reason) {
  Log(LogLevel::kWarning, shown_ + ": the input ends: " + reason);
  {
    const std::lock_guard lock(mutex_);
    report_.end = reason;
  }
  changed_.notify_all();
}

}  // namespace mono3d
