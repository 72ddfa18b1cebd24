// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "mono3d/core/timing.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/pipeline/pipeline.h"
#include "mono3d/pipeline/run_writer.h"
#include "mono3d/pipeline/self_calibrating_pipeline.h"

namespace mono3d::tools {

// Frames until the input ends, a stop is requested or an error comes; what is there by then is
// kept. `record` is told how it ended and how many images could not be read.
// `after_frame` is called with the index and the time stamp of each.
void ProcessFrames(FrameSource& source, Pipeline& pipeline, StageTimes& times, RunRecord& record,
                   const std::function<void(std::int64_t, double)>& after_frame);

enum class Pace {
  kByTimeStamps,  // a recording that is played
  kAsTheyCome,    // from a camera
};

// The same live.
void PushFrames(std::unique_ptr<FrameSource> source, Pace pace, Pipeline& pipeline,
                RunRecord& record);

// The same into a pipeline that learns its camera; `source` has images as taken.
void PushFrames(std::unique_ptr<FrameSource> source, Pace pace, SelfCalibratingPipeline& pipeline,
                RunRecord& record);

// The run failed, unless it had failed before.
void NoteFailure(const std::string& reason, RunRecord& record);

// Runs `step`; an error in it is what the run failed by, unless it had failed before.
void NoteErrorOf(RunRecord& record, const std::function<void()>& step);

// Finish, or Stop of a live run; what there is in spite of an error in it, which may be nothing.
Reconstruction FinishAfterAll(Pipeline& pipeline, RunRecord& record);
Reconstruction FinishAfterAll(SelfCalibratingPipeline& pipeline, RunRecord& record);

}  // namespace mono3d::tools
