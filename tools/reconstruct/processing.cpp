// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reconstruct/processing.h"

#include <exception>
#include <future>
#include <optional>
#include <utility>

#include "common/tool.h"
#include "mono3d/core/log.h"
#include "mono3d/core/thread_priority.h"
#include "mono3d/io/paced_source.h"

namespace mono3d::tools {
namespace {

// An end that fails is tried again: it leaves out the stage that failed.
constexpr int kMaxEnds = 3;

void NoteImagesLeftOut(const FrameSource& source, RunRecord& record) {
  record.num_skipped_images = source.num_skipped();
  if (record.num_passed_over_images) record.num_passed_over_images = source.num_passed_over();
}

// `process_next` until it has no more frames.
template <typename ProcessNext>
void ProcessAll(RunRecord& record, const ProcessNext& process_next) {
  try {
    while (!StopRequested()) {
      if (!process_next()) return;
    }
    record.end = RunEnd::kStopped;
  } catch (const std::exception& error) {
    NoteFailure(WordsOf(error), record);
  }
}

// `push` for each frame when it is due.
template <typename AnyPipeline, typename PushFrame>
void PushAll(std::unique_ptr<FrameSource> source, Pace pace, AnyPipeline& pipeline,
             RunRecord& record, const PushFrame& push) {
  if (pace == Pace::kByTimeStamps) {
    source = std::make_unique<PacedSource>(std::move(source), &StopRequested());
  }
  pipeline.Start();
  ProcessAll(record, [&] {
    std::optional<Frame> frame = source->Next();
    if (frame) push(*std::move(frame));
    return frame.has_value() || StopRequested();
  });
  NoteImagesLeftOut(*source, record);
}

// `stop`, and again after an error; an empty result where it fails each time.
template <typename StopPipeline>
Reconstruction StopAfterAll(RunRecord& record, const StopPipeline& stop) {
  for (int i = 0; i < kMaxEnds; ++i) {
    try {
      return stop();
    } catch (const std::exception& error) {
      NoteFailure(WordsOf(error), record);
    }
  }
  return {};
}

}  // namespace

void NoteFailure(const std::string& reason, RunRecord& record) {
  Log(LogLevel::kWarning, reason + "; writing what there is so far");
  if (record.end == RunEnd::kFailed) return;  // the first one is the reason
  record.end = RunEnd::kFailed;
  record.error = reason;
}

void ProcessFrames(FrameSource& source, Pipeline& pipeline, StageTimes& times, RunRecord& record,
                   const std::function<void(std::int64_t, double)>& after_frame) {
  const auto next_frame = [&] {
    std::optional<Frame> frame;
    {
      const ScopedStageTimer timer(&times, "io/read");
      frame = source.Next();
    }
    if (!frame) return false;
    const std::int64_t index = frame->index;
    const double timestamp_s = frame->timestamp_s;
    pipeline.Process(*std::move(frame));
    after_frame(index, timestamp_s);
    return true;
  };
  // A bundle's frames are tracked long before the model of the one before is made. At a lower
  // priority that fills the gaps that making models leaves, and takes no core from it.
  NoteErrorOf(record, [&] {
    std::async(std::launch::async, [&] {
      LowerThreadPriority(ThreadPriority::kTenth);
      ProcessAll(record, next_frame);
    }).get();
  });
  NoteImagesLeftOut(source, record);
}

void PushFrames(std::unique_ptr<FrameSource> source, Pace pace, Pipeline& pipeline,
                RunRecord& record) {
  PushAll(std::move(source), pace, pipeline, record,
          [&](Frame frame) { (void)pipeline.Push(std::move(frame)); });
}

void PushFrames(std::unique_ptr<FrameSource> source, Pace pace, SelfCalibratingPipeline& pipeline,
                RunRecord& record) {
  PushAll(std::move(source), pace, pipeline, record, [&](Frame frame) {
    (void)pipeline.Push(
        {frame.index, frame.timestamp_s, std::move(frame.name), std::move(frame.bgr)});
  });
}

void NoteErrorOf(RunRecord& record, const std::function<void()>& step) {
  try {
    step();
  } catch (const std::exception& error) {
    NoteFailure(WordsOf(error), record);
  }
}

Reconstruction FinishAfterAll(Pipeline& pipeline, RunRecord& record) {
  return StopAfterAll(record, [&] { return pipeline.Finish(); });
}

Reconstruction FinishAfterAll(SelfCalibratingPipeline& pipeline, RunRecord& record) {
  return StopAfterAll(record, [&] { return pipeline.Stop(); });
}

}  // namespace mono3d::tools
