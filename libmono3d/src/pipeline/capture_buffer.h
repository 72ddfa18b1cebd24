// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <atomic>
#include <cstddef>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "mono3d/calibration/camera_calibration.h"
#include "mono3d/pipeline/self_calibrating_pipeline.h"

namespace mono3d {

// The images of a video since its first one, until they need too much memory. Used by one thread at
// a time.
class CaptureBuffer {
 public:
  explicit CaptureBuffer(double max_mb) : max_mb_(max_mb) {}

  // Where there is no room for the frame, neither it nor any later one is kept.
  void Add(const CapturedFrame& frame);
  // The oldest frame, which is then no longer kept; nothing where there is none.
  std::optional<CapturedFrame> TakeFirst();
  void Clear();

  bool has_overflowed() const { return has_overflowed_; }
  // Is there hardly room for `factor` times as many frames?
  bool IsTooSmallFor(double factor) const;
  std::size_t size() const { return frames_.size(); }
  // Those from frame `first_index` on; the pixels are shared.
  std::vector<CapturedFrame> FramesFrom(std::int64_t first_index) const;

 private:
  double max_mb_;
  std::deque<CapturedFrame> frames_;
  std::size_t num_bytes_ = 0;
  bool has_overflowed_ = false;
};

// Opens `frames` as footage. Once `*is_stopped`, sources end and opening another one throws Error.
FootageOpener OpenerOf(std::shared_ptr<const std::vector<CapturedFrame>> frames,
                       const std::atomic<bool>& is_stopped);

}  // namespace mono3d
