// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reconstruct/processing.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "common/tool.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"

namespace mono3d::tools {
namespace {

void NoteFailure(const Error& error, RunRecord& record) {
  Log(LogLevel::kWarning, std::string(error.what()) + "; writing what there is so far");
  if (record.end == RunEnd::kFailed) return;  // the first one is the reason
  record.end = RunEnd::kFailed;
  record.error = error.what();
}

// `process_next` until it has no more frames.
template <typename ProcessNext>
void ProcessAll(RunRecord& record, const ProcessNext& process_next) {
  try {
    while (!StopRequested()) {
      if (!process_next()) return;
    }
    record.end = RunEnd::kStopped;
  } catch (const Error& error) {
    NoteFailure(error, record);
  }
}

LiveRecord Summarise(std::vector<double> latencies_ms, double elapsed_s, std::int64_t num_dropped) {
  LiveRecord live;
  live.num_dropped_frames = num_dropped;
  if (latencies_ms.empty()) return live;
  std::sort(latencies_ms.begin(), latencies_ms.end());
  const std::size_t count = latencies_ms.size();
  if (elapsed_s > 0) live.frames_per_s = static_cast<double>(count) / elapsed_s;
  for (const double latency_ms : latencies_ms) {
    live.mean_latency_ms += latency_ms / static_cast<double>(count);
  }
  live.p95_latency_ms = latencies_ms[count - 1 - (count - 1) / 20];
  live.max_latency_ms = latencies_ms.back();
  return live;
}

}  // namespace

void ProcessFrames(FrameSource& source, Pipeline& pipeline, StageTimes& times, RunRecord& record) {
  ProcessAll(record, [&] {
    std::optional<Frame> frame;
    {
      const ScopedStageTimer timer(&times, "io/read");
      frame = source.Next();
    }
    if (frame) pipeline.Process(*frame);
    return frame.has_value();
  });
  record.num_skipped_images = source.num_skipped();
}

void ProcessLive(std::unique_ptr<FrameSource> source, const LiveSourceOptions& options,
                 Pipeline& pipeline, RunRecord& record) {
  LiveSource live(std::move(source), options);
  std::vector<double> latencies_ms;
  std::optional<double> first_ms;
  double last_ms = 0;
  ProcessAll(record, [&] {
    const std::optional<Frame> frame = live.Next();
    if (!frame) return false;
    if (!first_ms) first_ms = WallClockMs();
    pipeline.Process(*frame);
    last_ms = WallClockMs();
    latencies_ms.push_back(1e3 * live.Latency_s(*frame));
    return true;
  });
  const double elapsed_s = first_ms ? 1e-3 * (last_ms - *first_ms) : 0;
  record.live = Summarise(std::move(latencies_ms), elapsed_s, live.num_dropped());
  record.num_skipped_images = live.num_skipped();
}

void NoteErrorOf(RunRecord& record, const std::function<void()>& step) {
  try {
    step();
  } catch (const Error& error) {
    NoteFailure(error, record);
  }
}

Reconstruction FinishAfterAll(Pipeline& pipeline, RunRecord& record) {
  try {
    return pipeline.Finish();
  } catch (const Error& error) {
    NoteFailure(error, record);
    return pipeline.Finish();
  }
}

}  // namespace mono3d::tools
