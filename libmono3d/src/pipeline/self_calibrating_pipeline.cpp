// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/pipeline/self_calibrating_pipeline.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <limits>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "pipeline/background_calibration.h"
#include "pipeline/calibration_verdict.h"
#include "pipeline/camera_run.h"
#include "pipeline/capture_buffer.h"
#include "pipeline/clock.h"
#include "pipeline/latencies.h"
#include "pipeline/surfel_numbers.h"
#include "pipeline/world_continuation.h"

namespace mono3d {
namespace {

// While frames come, a second run follows them at this pace where it waits for depth maps.
constexpr double kCatchUpPace = 3;
// Of the frames that the run in use has tracked, those that the second one must have.
constexpr double kMinTrackedShare = 0.9;
// A version that no surfel is newer than.
constexpr std::uint64_t kNoSurfels = std::numeric_limits<std::uint64_t>::max();

PipelineOptions WithLive(PipelineOptions options) {
  options.is_live = true;
  return options;
}

}  // namespace

class SelfCalibratingPipeline::Impl {
 public:
  Impl(SelfCalibrationSetup setup, const PipelineOptions& options,
       const SelfCalibrationOptions& calibration)
      : setup_(std::move(setup)),
        options_(WithLive(options)),
        calibration_options_(calibration),
        buffer_(calibration.max_buffer_mb),
        num_frames_due_(calibration.first_frames) {
    calibration.Validate();
    Validate(setup_.prior, "self-calibration");
    if (!setup_.calibrate) {
      setup_.calibrate = [=](const CameraPrior& prior, const FootageOpener& open) {
        return CalibrateCamera(prior, open, calibration.calibration);
      };
    }
    state_.camera = setup_.prior.camera;
    state_.reason = "too little was tracked to learn the camera";
    run_ = MakeRun(setup_.prior.camera, 0);
  }

  ~Impl() {
    {
      const std::lock_guard lock(push_mutex_);
      is_aborted_ = true;
    }
    pushed_.notify_all();
    if (thread_.joinable()) thread_.join();
  }

  void Start() {
    const std::lock_guard lock(push_mutex_);
    if (has_started_) throw Error("Start is not the first call");
    has_started_ = true;
    thread_ = std::thread([this] { Work(); });
  }

  PushResult Push(CapturedFrame frame);
  void GivePositions(PositionTrack track);
  PipelineSnapshot Snapshot(std::uint64_t since_version);
  Reconstruction Stop();
  const Tracker& tracker() { return run_->pipeline().tracker(); }

 private:
  std::shared_ptr<CameraRun> MakeRun(const CameraModel& camera, int number);
  void RequireNext(const CapturedFrame& frame) const;

  // The thread that waits.
  void Work();
  void LearnCamera();
  std::shared_ptr<const std::vector<CapturedFrame>> WaitForFootage();
  void Adopt(const CameraModel& camera);
  bool CatchUp(const std::shared_ptr<CameraRun>& second);
  bool ReplaceRun(const std::shared_ptr<CameraRun>& second);
  void WaitForDepth(const CameraRun& run, double start_s, double video_s) const;
  bool IsWatched();
  void NoteReason(const std::string& reason);

  SelfCalibrationSetup setup_;
  PipelineOptions options_;
  SelfCalibrationOptions calibration_options_;
  FrameLatencies latencies_;
  std::mutex observer_mutex_;  // one call of on_frame at a time

  std::mutex push_mutex_;  // before state_mutex_, where both are held
  std::condition_variable pushed_;
  CaptureBuffer buffer_;
  bool is_buffering_ = true;
  bool has_started_ = false;
  bool has_failed_ = false;
  std::optional<CapturedFrame> latest_;  // pushed, without its image
  std::int64_t num_dropped_ = 0;         // that were told
  std::atomic<bool> is_ending_ = false;
  std::atomic<bool> is_aborted_ = false;

  std::mutex state_mutex_;          // held for a moment only
  std::shared_ptr<CameraRun> run_;  // in use; changes under both locks
  std::atomic<int> run_number_ = 0;
  SurfelNumbers numbers_;
  bool is_watched_ = false;  // somebody asked for surfels
  SelfCalibration state_;
  std::vector<TrajectoryEntry> online_before_;  // of the run before,
  std::int64_t last_before_ = -1;               // up to this frame
  std::int64_t num_dropped_before_ = 0;

  // The waiting thread's own.
  std::int64_t num_frames_due_;
  std::size_t num_frames_tried_ = 0;
  std::thread thread_;
};

std::shared_ptr<CameraRun> SelfCalibratingPipeline::Impl::MakeRun(const CameraModel& camera,
                                                                  int number) {
  PipelineObserver observer;
  if (setup_.create_observer) observer = setup_.create_observer(camera);
  observer.on_frame = [this, number,
                       on_frame = std::move(observer.on_frame)](const PipelineProgress& progress) {
    const std::lock_guard lock(observer_mutex_);
    if (number != run_number_) return;
    latencies_.Tracked(progress.frame_index);
    if (on_frame) on_frame(progress);
  };
  PipelineOptions options;
  {
    const std::lock_guard lock(state_mutex_);
    options = options_;
  }
  return std::make_shared<CameraRun>(camera, setup_.create_stages(), std::move(observer), options);
}

void SelfCalibratingPipeline::Impl::RequireNext(const CapturedFrame& frame) const {
  if (!has_started_) throw Error("Push before Start");
  if (is_ending_) throw Error("a frame came after the end");
  RequireImageOf(setup_.prior.camera, frame);
  if (latest_) RequireOrder(*latest_, frame);
}

PushResult SelfCalibratingPipeline::Impl::Push(CapturedFrame captured) {
  PushResult result;
  {
    const std::lock_guard lock(push_mutex_);
    RequireNext(captured);
    const CapturedFrame frame = WithOwnPixels(std::move(captured));
    latencies_.Pushed(frame.index);
    try {
      result = run_->Push(frame);
      num_dropped_ += static_cast<std::int64_t>(result.dropped.size());
    } catch (...) {
      has_failed_ = true;
      pushed_.notify_all();
      throw;
    }
    if (is_buffering_) buffer_.Add(frame);
    latest_ = frame;
    latest_->bgr.release();
  }
  pushed_.notify_all();
  return result;
}

// The second run begins with the latest ones.
void SelfCalibratingPipeline::Impl::GivePositions(PositionTrack track) {
  const std::lock_guard lock(state_mutex_);
  if (!options_.positions) throw UsageError("GivePositions without PipelineOptions::positions");
  options_.positions->track = track;
  run_->pipeline().GivePositions(std::move(track));
}

// Again where the run was replaced meanwhile.
PipelineSnapshot SelfCalibratingPipeline::Impl::Snapshot(std::uint64_t since_version) {
  while (true) {
    std::shared_ptr<CameraRun> run;
    SurfelNumbers numbers;
    {
      const std::lock_guard lock(state_mutex_);
      run = run_;
      numbers = numbers_;
      is_watched_ = true;
    }
    PipelineSnapshot snapshot = run->pipeline().Snapshot(numbers.OwnVersion(since_version));
    run->worlds().Move(snapshot);
    numbers.Renumber(snapshot.surfels);
    const std::lock_guard lock(state_mutex_);
    if (run != run_) continue;
    numbers_.NoteHandedOut(snapshot.surfels);
    return snapshot;
  }
}

Reconstruction SelfCalibratingPipeline::Impl::Stop() {
  {
    const std::lock_guard lock(push_mutex_);
    is_ending_ = true;
  }
  pushed_.notify_all();
  if (thread_.joinable()) thread_.join();
  Reconstruction result = run_->pipeline().Stop();
  const WorldContinuation worlds = run_->worlds();
  worlds.Move(result);
  result.self_calibration = state_;
  if (!state_.adopted_at_frame) return result;
  LiveStatistics live = latencies_.Statistics();
  live.num_dropped_frames = num_dropped_before_ + result.counts.num_dropped_frames;
  result.live = live;
  worlds.ContinueOnline(online_before_, last_before_ + 1, result);
  return result;
}

void SelfCalibratingPipeline::Impl::NoteReason(const std::string& reason) {
  const std::lock_guard lock(state_mutex_);
  state_.reason = reason;
}

void SelfCalibratingPipeline::Impl::Work() {
  try {
    LearnCamera();
  } catch (const std::exception& error) {
    if (is_aborted_) return;
    Log(LogLevel::kWarning, std::string("no camera was learned: ") + error.what());
    NoteReason(error.what());
  }
  const std::lock_guard lock(push_mutex_);
  is_buffering_ = false;
  buffer_.Clear();
}

void SelfCalibratingPipeline::Impl::LearnCamera() {
  while (const auto footage = WaitForFootage()) {
    const CameraCalibration found =
        CalibrateInBackground(setup_.calibrate, setup_.prior, footage, is_aborted_);
    if (is_aborted_) return;
    bool is_last_chance = false;
    {
      const std::lock_guard lock(push_mutex_);
      is_last_chance = is_ending_ || buffer_.has_overflowed() || buffer_.IsTooSmallFor(2);
    }
    {
      const std::lock_guard lock(state_mutex_);
      ++state_.num_attempts;
      state_.calibration = found;
    }
    switch (Judge(found, is_last_chance)) {
      case CalibrationVerdict::kBetter:
        Adopt(found.posterior.camera);
        return;
      case CalibrationVerdict::kAgrees:
        NoteReason("the images agree with the camera");
        return;
      case CalibrationVerdict::kUndecided:
        NoteReason(found.reason.empty() ? "the images do not tell the camera well enough"
                                        : found.reason);
    }
    num_frames_due_ = std::max(2 * num_frames_due_, static_cast<std::int64_t>(footage->size()));
  }
}

// From the first frame that was tracked on; null where no more are to be tried.
std::shared_ptr<const std::vector<CapturedFrame>> SelfCalibratingPipeline::Impl::WaitForFootage() {
  std::unique_lock lock(push_mutex_);
  const auto is_due = [&] {
    return is_aborted_ || has_failed_ || is_ending_ || buffer_.has_overflowed() ||
           run_->num_tracked() >= num_frames_due_;
  };
  // Nobody tells it when a frame has been tracked.
  constexpr auto kPollInterval = std::chrono::milliseconds(50);
  while (!pushed_.wait_for(lock, kPollInterval, is_due)) continue;
  if (is_aborted_ || has_failed_) return nullptr;
  auto footage = std::make_shared<const std::vector<CapturedFrame>>(
      buffer_.FramesFrom(run_->first_tracked().value_or(0)));
  if (footage->size() <= num_frames_tried_) return nullptr;
  num_frames_tried_ = footage->size();
  return footage;
}

void SelfCalibratingPipeline::Impl::Adopt(const CameraModel& camera) {
  std::shared_ptr<CameraRun> first = run_;
  {
    const std::lock_guard lock(push_mutex_);
    if (buffer_.has_overflowed()) {
      NoteReason("it was learned too late: the images from the beginning were no longer kept");
      return;
    }
  }
  first->HoldModel(true);
  bool is_replaced = false;
  try {
    const std::shared_ptr<CameraRun> second = MakeRun(camera, 1);
    is_replaced = CatchUp(second);
  } catch (...) {
    first->HoldModel(false);
    throw;
  }
  if (!is_replaced) {
    first->HoldModel(false);
    return;
  }
  // A Snapshot may still be asking it.
  while (first.use_count() > 1) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  first.reset();
  if (setup_.on_adoption) setup_.on_adoption(state_);
}

// The second run takes all frames; true once it is the one in use.
bool SelfCalibratingPipeline::Impl::CatchUp(const std::shared_ptr<CameraRun>& second) {
  const double start_s = Clock_s();
  std::optional<double> first_frame_s;
  while (!is_aborted_) {
    std::optional<CapturedFrame> frame;
    {
      const std::lock_guard lock(push_mutex_);
      if (buffer_.has_overflowed()) {
        NoteReason("tracking with it did not catch up with the camera");
        return false;
      }
      frame = buffer_.TakeFirst();
      if (!frame) return ReplaceRun(second);
    }
    first_frame_s = first_frame_s.value_or(frame->timestamp_s);
    (void)second->Push(*frame);
    second->WaitForTracking(is_aborted_);
    WaitForDepth(*second, start_s, frame->timestamp_s - *first_frame_s);
    // So that there are surfels to show when it replaces the other.
    if (IsWatched()) (void)second->pipeline().Snapshot(kNoSurfels);
  }
  return false;
}

// Until no bundle waits for the depth stage, or as long as the pace allows: that of the camera
// where nobody waits for the second run to be up to date.
void SelfCalibratingPipeline::Impl::WaitForDepth(const CameraRun& run, double start_s,
                                                 double video_s) const {
  constexpr auto kPollInterval = std::chrono::milliseconds(2);
  while (!is_aborted_ && run.HasWaitingBundle()) {
    const double pace = is_ending_ ? 1 : kCatchUpPace;
    if (Clock_s() >= start_s + video_s / pace) return;
    std::this_thread::sleep_for(kPollInterval);
  }
}

bool SelfCalibratingPipeline::Impl::IsWatched() {
  const std::lock_guard lock(state_mutex_);
  return is_watched_;
}

// With push_mutex_ held.
bool SelfCalibratingPipeline::Impl::ReplaceRun(const std::shared_ptr<CameraRun>& second) {
  if (static_cast<double>(second->num_tracked()) <
      kMinTrackedShare * static_cast<double>(run_->num_tracked())) {
    NoteReason("fewer frames can be tracked with it");
    return false;
  }
  const WorldContinuation worlds(run_->Trajectory(), second->Trajectory(), run_->poses_version());
  second->SetWorlds(worlds);
  is_buffering_ = false;
  const std::lock_guard lock(state_mutex_);
  if (options_.positions) second->pipeline().GivePositions(options_.positions->track);
  last_before_ = run_->last_processed();
  online_before_ = run_->OnlineTrajectory();
  num_dropped_before_ = num_dropped_;
  numbers_.BeginRun();
  state_.camera = second->camera();
  state_.adopted_at_frame = latest_ ? latest_->index + 1 : 0;
  state_.reason.clear();
  run_ = second;
  run_number_ = 1;
  return true;
}

SelfCalibratingPipeline::SelfCalibratingPipeline(SelfCalibrationSetup setup,
                                                 const PipelineOptions& options,
                                                 const SelfCalibrationOptions& calibration)
    : impl_(std::make_unique<Impl>(std::move(setup), options, calibration)) {}

SelfCalibratingPipeline::~SelfCalibratingPipeline() = default;

void SelfCalibratingPipeline::Start() { impl_->Start(); }

PushResult SelfCalibratingPipeline::Push(CapturedFrame frame) {
  return impl_->Push(std::move(frame));
}

void SelfCalibratingPipeline::GivePositions(PositionTrack track) {
  impl_->GivePositions(std::move(track));
}

PipelineSnapshot SelfCalibratingPipeline::Snapshot(std::uint64_t since_version) const {
  return impl_->Snapshot(since_version);
}

Reconstruction SelfCalibratingPipeline::Stop() { return impl_->Stop(); }

const Tracker& SelfCalibratingPipeline::tracker() const { return impl_->tracker(); }

}  // namespace mono3d
