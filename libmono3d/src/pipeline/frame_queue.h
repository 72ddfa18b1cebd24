// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "mono3d/image/frame.h"
#include "mono3d/pipeline/pipeline.h"

namespace mono3d {

// Frames that wait to be tracked, the oldest first. The oldest one is dropped when it has waited
// for too long, or when the images need too much memory; the newest one never is.
class FrameQueue {
 public:
  explicit FrameQueue(const LiveOptions& options) : options_(options) {}

  struct Waiting {
    Frame frame;
    double since_s = 0;
  };

  // Returns the indices of the frames that were dropped since the last call.
  std::vector<std::int64_t> Add(Frame frame, double now_s);
  std::optional<Waiting> Take(double now_s);

  std::size_t size() const { return waiting_.size(); }
  std::int64_t num_dropped() const { return num_dropped_; }

 private:
  void Drop(double now_s);

  LiveOptions options_;
  std::deque<Waiting> waiting_;
  std::size_t num_bytes_ = 0;  // of their images
  std::vector<std::int64_t> dropped_;
  std::int64_t num_dropped_ = 0;
};

}  // namespace mono3d
