// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/camera_run.h"

#include <algorithm>
#include <chrono>
#include <limits>
#include <utility>

namespace mono3d {
namespace {

class HoldableSelector final : public KeyframeSelector {
 public:
  HoldableSelector(std::unique_ptr<KeyframeSelector> selector, std::shared_ptr<BundleFlow> flow)
      : selector_(std::move(selector)), flow_(std::move(flow)) {}

  std::optional<ImageBundle> Add(const Keyframe& keyframe, const KeyframePoses& poses) override {
    std::optional<ImageBundle> bundle = selector_->Add(keyframe, poses);
    if (!bundle || flow_->is_held) return std::nullopt;
    flow_->has_waiting = true;
    return bundle;
  }
  void ReportDepthQuality(const DepthQuality& quality) override {
    selector_->ReportDepthQuality(quality);
  }

 private:
  std::unique_ptr<KeyframeSelector> selector_;
  std::shared_ptr<BundleFlow> flow_;
};

class WatchedEstimator final : public DepthEstimator {
 public:
  WatchedEstimator(std::unique_ptr<DepthEstimator> estimator, std::shared_ptr<BundleFlow> flow)
      : estimator_(std::move(estimator)), flow_(std::move(flow)) {}

  DepthResult Estimate(const ImageBundle& bundle) override {
    flow_->has_waiting = false;
    return estimator_->Estimate(bundle);
  }
  void SetEffort(DepthEffort effort) override { estimator_->SetEffort(effort); }

 private:
  std::unique_ptr<DepthEstimator> estimator_;
  std::shared_ptr<BundleFlow> flow_;
};

}  // namespace

CameraRun::CameraRun(const CameraModel& camera, PipelineStages stages, PipelineObserver observer,
                     const PipelineOptions& options)
    : lens_(camera), observer_(std::move(observer)), tracker_(stages.tracker.get()) {
  stages.keyframe_selector =
      std::make_unique<HoldableSelector>(std::move(stages.keyframe_selector), flow_);
  stages.depth_estimator =
      std::make_unique<WatchedEstimator>(std::move(stages.depth_estimator), flow_);
  pipeline_ = std::make_unique<Pipeline>(std::move(stages), OwnObserver(), options);
  pipeline_->Start();
}

PipelineObserver CameraRun::OwnObserver() {
  PipelineObserver own;
  own.on_frame = [this](const PipelineProgress& progress) { OnFrame(progress); };
  own.on_keyframe = observer_.on_keyframe;
  if (observer_.on_depth_map) {
    own.on_depth_map = [this](const DepthMap& map, const FusionResult& fusion) {
      OnDepthMap(map, fusion);
    };
  }
  return own;
}

PushResult CameraRun::Push(const CapturedFrame& frame) {
  PushResult result = pipeline_->Push(lens_.Undistort(frame));
  const std::lock_guard lock(mutex_);
  ++num_pushed_;
  return result;
}

void CameraRun::WaitForTracking(const std::atomic<bool>& is_stopped) {
  constexpr auto kPollInterval = std::chrono::milliseconds(100);
  while (!is_stopped) {
    std::unique_lock lock(mutex_);
    if (tracked_.wait_for(lock, kPollInterval, [&] { return num_processed_ >= num_pushed_ - 1; })) {
      return;
    }
    lock.unlock();
    // A tracking thread that has failed processes nothing any more.
    (void)pipeline_->Snapshot(std::numeric_limits<std::uint64_t>::max());
  }
}

void CameraRun::NoteTracked(const PipelineProgress& progress) {
  const TrackingResult& tracking = progress.tracking;
  {
    const std::lock_guard lock(mutex_);
    ++num_processed_;
    last_processed_ = progress.frame_index;
    const auto add = [&](const FramePose& pose) {
      poses_.push_back(pose);
      first_tracked_ = std::min(first_tracked_.value_or(pose.frame_index), pose.frame_index);
    };
    for (const FramePose& pose : tracking.recovered) add(pose);
    if (tracking.pose) {
      add(*tracking.pose);
      if (tracking.T_world_cam) {
        online_.push_back({tracking.pose->frame_index, tracking.pose->timestamp_s, tracking.map_id,
                           *tracking.T_world_cam});
      }
    }
  }
  tracked_.notify_all();
}

void CameraRun::OnFrame(const PipelineProgress& progress) {
  NoteTracked(progress);
  if (!observer_.on_frame) return;
  const WorldContinuation moving = worlds();
  if (moving.IsIdentity() || !progress.tracking.T_world_cam) {
    observer_.on_frame(progress);
    return;
  }
  TrackingResult tracking = progress.tracking;
  tracking.T_world_cam = moving.Of(tracking.map_id) * *tracking.T_world_cam;
  observer_.on_frame({progress.counts, tracking, progress.num_surfels, progress.health,
                      progress.frame_index, moving.Moved(progress.place)});
}

void CameraRun::OnDepthMap(const DepthMap& map, const FusionResult& fusion) {
  const WorldContinuation moving = worlds();
  const KeyframePosesPtr poses = tracker_->Poses();
  const KeyframePose* keyframe = poses->Find(map.keyframe_id);
  if (moving.IsIdentity() || keyframe == nullptr) {
    observer_.on_depth_map(map, fusion);
    return;
  }
  FusionResult moved = fusion;
  moved.S_world_kf = moving.Of(keyframe->map_id) * fusion.S_world_kf;
  observer_.on_depth_map(map, moved);
}

std::vector<TrajectoryEntry> CameraRun::Trajectory() const {
  std::vector<FramePose> frames;
  {
    const std::lock_guard lock(mutex_);
    frames = poses_;
  }
  const KeyframePosesPtr poses = tracker_->Poses();
  std::vector<TrajectoryEntry> entries;
  for (const FramePose& frame : frames) {
    if (const auto entry = InWorld(frame, *poses)) entries.push_back(*entry);
  }
  return entries;
}

std::vector<TrajectoryEntry> CameraRun::OnlineTrajectory() const {
  const std::lock_guard lock(mutex_);
  return online_;
}

std::int64_t CameraRun::num_tracked() const {
  const std::lock_guard lock(mutex_);
  return static_cast<std::int64_t>(poses_.size());
}

std::optional<std::int64_t> CameraRun::first_tracked() const {
  const std::lock_guard lock(mutex_);
  return first_tracked_;
}

std::int64_t CameraRun::last_processed() const {
  const std::lock_guard lock(mutex_);
  return last_processed_;
}

void CameraRun::SetWorlds(WorldContinuation worlds) {
  const std::lock_guard lock(mutex_);
  worlds_ = std::move(worlds);
}

WorldContinuation CameraRun::worlds() const {
  const std::lock_guard lock(mutex_);
  return worlds_;
}

}  // namespace mono3d
