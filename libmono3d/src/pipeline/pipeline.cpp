// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/pipeline/pipeline.h"

#include <string>
#include <utility>

#include "core/out_of_memory.h"
#include "pipeline/chain.h"
#include "pipeline/direct_model_worker.h"
#include "pipeline/model_thread.h"

namespace mono3d {
namespace {

Chain MakeChain(PipelineStages stages, const PipelineObserver& observer,
                const SurfelExportOptions& surfel_export, PipelineMode mode) {
  ModelStages model = {std::move(stages.depth_estimator), std::move(stages.create_surfel_map),
                       observer.on_depth_map, surfel_export};
  std::unique_ptr<ModelWorker> worker;
  if (mode == PipelineMode::kLive) {
    worker = std::make_unique<ModelThread>(std::move(model));
  } else {
    worker = std::make_unique<DirectModelWorker>(std::move(model));
  }
  return {std::move(stages.tracker), std::move(stages.keyframe_selector), std::move(worker)};
}

}  // namespace

struct Pipeline::State {
  Chain chain;
  std::function<void(const PipelineProgress&)> on_frame;
};

Pipeline::Pipeline(PipelineStages stages, PipelineObserver observer,
                   const SurfelExportOptions& surfel_export, PipelineMode mode)
    : state_(new State{MakeChain(std::move(stages), observer, surfel_export, mode),
                       std::move(observer.on_frame)}) {}

Pipeline::~Pipeline() = default;

void Pipeline::Process(const Frame& frame) {
  NamingOutOfMemory("frame " + std::to_string(frame.index), [&] {
    const TrackingResult tracking = state_->chain.Process(frame);
    if (!state_->on_frame) return;
    const ModelProgress progress = state_->chain.Progress();
    state_->on_frame({progress.counts, tracking, progress.num_surfels, progress.health});
  });
}

Reconstruction Pipeline::Finish() {
  Reconstruction result;
  NamingOutOfMemory("end of the run", [&] { result = state_->chain.Finish(); });
  return result;
}

const Tracker& Pipeline::tracker() const { return state_->chain.tracker(); }

Reconstruction Pipeline::Run(FrameSource& source, const std::atomic<bool>* stop) {
  while (stop == nullptr || !stop->load()) {
    const std::optional<Frame> frame = source.Next();
    if (!frame) break;
    Process(*frame);
  }
  return Finish();
}

}  // namespace mono3d
