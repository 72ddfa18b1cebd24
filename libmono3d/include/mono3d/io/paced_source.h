// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>

#include "mono3d/core/export.h"
#include "mono3d/io/frame_source.h"

namespace MONO3D_EXPORT mono3d {

// Plays another source as a camera would: Next returns a frame when it is due by its time stamp, as
// long as reading keeps up with that. A gap of more than ten seconds is not waited for, with a
// warning. Calls from one thread at a time.
class PacedSource final : public ForwardingSource {
 public:
  // Where `*stop` becomes true, Next no longer waits, and there are no more frames.
  explicit PacedSource(std::unique_ptr<FrameSource> source,
                       const std::atomic<bool>* stop = nullptr);

  // The first frame is due as soon as it is read.
  [[nodiscard]] std::optional<Frame> Next() override;

 private:
  bool IsStopped() const { return stop_ != nullptr && stop_->load(); }

  const std::atomic<bool>* stop_;
  std::optional<double> start_s_;  // when a frame with time stamp 0 would have been due
};

}  // namespace mono3d
