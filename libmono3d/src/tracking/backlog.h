// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "mono3d/image/frame.h"

namespace mono3d::tracking {

// Frames without a pose since the last one that had one: they may get theirs once a map has
// started, or the known one is in view again. The oldest go when all images together exceed
// `max_bytes`.
class Backlog {
 public:
  explicit Backlog(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  void Add(const Frame& frame);
  // Takes out the frames before the one of index `end` that come after the one of index `begin`,
  // in the order of flight.
  std::vector<Frame> Take(std::int64_t begin, std::int64_t end);
  void Clear();
  std::size_t size() const { return frames_.size(); }
  const std::deque<Frame>& frames() const { return frames_; }
  // For the archives of image/state_archive.h.
  template <typename Archive>
  void ExchangeState(Archive& archive);

 private:
  std::size_t max_bytes_;
  std::size_t num_bytes_ = 0;
  std::deque<Frame> frames_;
};

}  // namespace mono3d::tracking
