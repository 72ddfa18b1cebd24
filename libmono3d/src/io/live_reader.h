// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "io/image_source.h"
#include "io/live_clock.h"
#include "io/live_connection.h"
#include "mono3d/io/live_input.h"

namespace mono3d {

// Connects anew, within so many seconds; throws Error where that fails, and ends soon after the
// flag becomes true.
using LiveConnector =
    std::function<std::unique_ptr<LiveConnection>(double, const std::atomic<bool>&)>;

// Takes the images of a live input in a thread of its own, and makes broken connections again.
class LiveReader {
 public:
  // Connects and waits for the first image; throws Error where none comes. `name`: of the frames;
  // `shown`: the address in messages.
  LiveReader(LiveConnector connect, std::string name, std::string shown,
             const LiveInputOptions& options);
  ~LiveReader();
  LiveReader(const LiveReader&) = delete;
  LiveReader& operator=(const LiveReader&) = delete;

  cv::Size size() const { return size_; }  // of the first image

  // From now on images count, and up to a few wait; before, the newest one is kept.
  void Begin();
  // The next image; nothing at the end or once `*stop`.
  std::optional<SourceImage> Next(const std::atomic<bool>* stop);

  // No more images are wanted: those that still come are not counted.
  void End() { is_cancelled_ = true; }

  LiveInputReport Report() const;

 private:
  void Run();
  void Add(LiveRead read, double arrival_s);
  bool Reconnect(std::string reason);
  void Wait(double wait_s);
  void SetEnd(const std::string& reason);

  LiveConnector connect_;
  std::string name_;
  std::string shown_;
  LiveInputOptions options_;
  cv::Size size_;
  std::atomic<bool> is_cancelled_ = false;

  // Of the thread.
  std::unique_ptr<LiveConnection> connection_;
  LiveClock clock_;
  double last_arrival_s_ = 0;  // of an image
  bool is_after_break_ = false;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<SourceImage> waiting_;
  bool has_begun_ = false;
  double start_s_ = 0;  // of the first image that counts
  LiveInputReport report_;
  std::thread thread_;
};

}  // namespace mono3d
