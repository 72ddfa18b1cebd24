// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "mono3d/core/options.h"
#include "mono3d/io/frame_source.h"

namespace mono3d {

struct LiveSourceOptions {
  double max_delay_s = 0.5;  // that a frame waits to be taken; older ones are dropped

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

// Plays another source as a camera would: a frame comes when it is due by its time stamp, whether
// somebody takes it or not. Reads ahead in a thread of its own. Frames that have waited for longer
// than `max_delay_s` are dropped and counted, the newest never is.
class LiveSource final : public FrameSource {
 public:
  // The first frame is due as soon as it is read.
  LiveSource(std::unique_ptr<FrameSource> source, const LiveSourceOptions& options);
  ~LiveSource() override;

  // Waits for the next frame. Throws what the source has thrown, after the frames before that.
  [[nodiscard]] std::optional<Frame> Next() override;

  std::optional<std::int64_t> num_frames() const override;
  std::int64_t num_skipped() const override;
  const CameraModel& camera() const override;
  std::int64_t num_dropped() const;
  // Time since a frame that came from here was due.
  double Latency_s(const Frame& frame) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace mono3d
