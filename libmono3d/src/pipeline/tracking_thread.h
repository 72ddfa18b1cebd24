// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "mono3d/pipeline/pipeline.h"
#include "pipeline/first_error.h"
#include "pipeline/frame_queue.h"

namespace mono3d {

// Processes frames in a thread of its own, in the order in which they come. Push and Statistics
// from any thread.
class TrackingThread {
 public:
  // What `process` throws goes to `error`; no further frame is processed then.
  TrackingThread(const LiveOptions& options, std::function<void(const Frame&)> process,
                 FirstError& error);
  // Ends after the frame in hand; those that wait are not processed.
  ~TrackingThread();
  TrackingThread(const TrackingThread&) = delete;
  TrackingThread& operator=(const TrackingThread&) = delete;

  // Throws Error on an invalid frame, one of another camera or not after the one before, and after
  // End.
  PushResult Push(Frame frame);

  // No more frames: returns once those that wait have been processed.
  void End();

  LiveStatistics Statistics() const;

 private:
  void Run();
  void RequireNext(const Frame& frame);

  std::function<void(const Frame&)> process_;
  FirstError& error_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  FrameQueue queue_;
  std::optional<Frame> latest_;  // pushed, without its image
  bool is_ending_ = false;       // no more frames come
  bool is_aborted_ = false;      // those that wait are not wanted any more
  std::vector<double> latencies_ms_;
  double first_s_ = 0, last_s_ = 0;  // when the first was pushed and the latest was processed
  std::thread thread_;
};

}  // namespace mono3d
