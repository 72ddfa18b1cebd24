// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/pipeline/pipeline.h"

#include <optional>
#include <string>
#include <utility>

#include "core/out_of_memory.h"
#include "mono3d/core/error.h"
#include "pipeline/chain.h"
#include "pipeline/direct_model_worker.h"
#include "pipeline/first_error.h"
#include "pipeline/model_thread.h"
#include "pipeline/tracking_thread.h"
#include "pipeline/trailing_model_worker.h"

namespace mono3d {
namespace {

std::unique_ptr<ModelWorker> MakeWorker(std::unique_ptr<DepthEstimator> estimator,
                                        ModelStages stages, const PipelineOptions& options,
                                        FirstError& error) {
  if (options.is_live) {
    return std::make_unique<ModelThread>(
        std::move(estimator), std::move(stages),
        static_cast<std::size_t>(options.live.max_waiting_bundles),
        [&error](const std::exception_ptr& thrown) { error.Set(thrown); });
  }
  if (options.models_trail) {
    return std::make_unique<TrailingModelWorker>(std::move(estimator), std::move(stages));
  }
  return std::make_unique<DirectModelWorker>(std::move(estimator), std::move(stages));
}

// A frame whose image nobody else can change: trackers keep the images of frames.
Frame WithOwnImage(Frame frame) {
  const cv::Mat& bgr = frame.bgr;
  const bool is_own = bgr.empty() || (bgr.u != nullptr && bgr.u->refcount == 1);
  if (!is_own) frame.bgr = bgr.clone();
  return frame;
}

}  // namespace

class Pipeline::Impl {
 public:
  Impl(PipelineStages stages, PipelineObserver observer, const PipelineOptions& options)
      : live_options_(options.live),
        on_frame_(std::move(observer.on_frame)),
        chain_(std::move(stages.tracker), std::move(stages.keyframe_selector),
               MakeWorker(std::move(stages.depth_estimator),
                          {std::move(stages.create_surfel_map), std::move(observer.on_depth_map),
                           options.surfel_export},
                          options, error_),
               std::move(observer.on_keyframe), options) {}

  void Process(Frame frame) {
    if (thread_) throw Error("Process after Start: frames are pushed");
    has_processed_ = true;
    Track(WithOwnImage(std::move(frame)));
  }

  void SaveState(StateFolder& folder, const std::function<void()>& at_rest) {
    if (thread_) throw UsageError("the state of a live run cannot be saved");
    NamingOutOfMemory("saving the state of the run", [&] { chain_.SaveState(folder, at_rest); });
  }

  void RestoreState(const StateFolder& folder, const ImageOfFrame& images) {
    if (thread_ || has_processed_) throw UsageError("RestoreState is not the first call");
    has_processed_ = true;
    NamingOutOfMemory("restoring the state of the run",
                      [&] { chain_.RestoreState(folder, images); });
  }

  void Start() {
    if (thread_ || has_processed_) throw Error("Start is not the first call");
    thread_ = std::make_unique<TrackingThread>(
        live_options_, [this](const Frame& frame) { Track(frame); }, error_);
  }

  PushResult Push(Frame frame) {
    if (!thread_) throw Error("Push before Start");
    error_.Throw();
    return thread_->Push(WithOwnImage(std::move(frame)));
  }

  void GivePositions(PositionTrack track) { chain_.GivePositions(std::move(track)); }

  PipelineSnapshot Snapshot(std::optional<std::uint64_t> since_version) {
    if (thread_) error_.ThrowIfNew();
    PipelineSnapshot snapshot = since_version ? chain_.Snapshot(*since_version) : chain_.State();
    if (thread_) snapshot.counts.num_dropped_frames = thread_->Statistics().num_dropped_frames;
    return snapshot;
  }

  Reconstruction Finish() {
    has_processed_ = true;
    if (thread_) {
      thread_->End();
      error_.ThrowIfNew();
      if (error_.IsSet()) chain_.Abandon();
    }
    Reconstruction result;
    try {
      NamingOutOfMemory("end of the run", [&] { result = chain_.Finish(); });
    } catch (...) {
      error_.NoteThrown();
      throw;
    }
    if (!thread_) return result;
    result.live = thread_->Statistics();
    result.counts.num_dropped_frames = result.live->num_dropped_frames;
    return result;
  }

  const Tracker& tracker() const { return chain_.tracker(); }

 private:
  void Track(const Frame& frame) {
    NamingOutOfMemory("frame " + std::to_string(frame.index), [&] {
      const TrackingResult tracking = chain_.Process(frame);
      if (!on_frame_) return;
      const PipelineSnapshot now = chain_.State();
      on_frame_({now.counts, tracking, now.num_surfels, now.health, frame.index, now.place});
    });
  }

  LiveOptions live_options_;
  std::function<void(const PipelineProgress&)> on_frame_;
  FirstError error_;  // of the threads
  Chain chain_;
  bool has_processed_ = false;
  std::unique_ptr<TrackingThread> thread_;  // after Start; ends first
};

Pipeline::Pipeline(PipelineStages stages, PipelineObserver observer, const PipelineOptions& options)
    : impl_(std::make_unique<Impl>(std::move(stages), std::move(observer), options)) {}

Pipeline::~Pipeline() = default;

void Pipeline::Process(Frame frame) { impl_->Process(std::move(frame)); }

void Pipeline::SaveState(StateFolder& folder, const std::function<void()>& at_rest) {
  impl_->SaveState(folder, at_rest);
}

std::vector<std::int64_t> Pipeline::FramesOfState(const StateFolder& folder) {
  return Chain::FramesOfState(folder);
}

void Pipeline::RestoreState(const StateFolder& folder, const ImageOfFrame& images) {
  impl_->RestoreState(folder, images);
}

Reconstruction Pipeline::Finish() { return impl_->Finish(); }

Reconstruction Pipeline::Run(FrameSource& source, const std::atomic<bool>* stop) {
  while (stop == nullptr || !stop->load()) {
    std::optional<Frame> frame = source.Next();
    if (!frame) break;
    Process(*std::move(frame));
  }
  return Finish();
}

void Pipeline::Start() { impl_->Start(); }

PushResult Pipeline::Push(Frame frame) { return impl_->Push(std::move(frame)); }

void Pipeline::GivePositions(PositionTrack track) { impl_->GivePositions(std::move(track)); }

PipelineSnapshot Pipeline::Snapshot(std::uint64_t since_version) const {
  return impl_->Snapshot(since_version);
}

PipelineSnapshot Pipeline::State() const { return impl_->Snapshot(std::nullopt); }

Reconstruction Pipeline::Stop() { return impl_->Finish(); }

const Tracker& Pipeline::tracker() const { return impl_->tracker(); }

}  // namespace mono3d
