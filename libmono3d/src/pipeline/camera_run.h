// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "mono3d/pipeline/pipeline.h"
#include "pipeline/captured_frame.h"
#include "pipeline/world_continuation.h"

namespace mono3d {

// What the selector and the depth stage of one pipeline tell.
struct BundleFlow {
  std::atomic<bool> is_held = false;      // no more bundles are made
  std::atomic<bool> has_waiting = false;  // one came since the depth stage began with its latest
};

// A live pipeline with one camera, from images as taken.
class CameraRun {
 public:
  // The observer gets poses in the worlds that SetWorlds says.
  CameraRun(const CameraModel& camera, PipelineStages stages, PipelineObserver observer,
            const PipelineOptions& options);

  // In the order of time; throws as Pipeline::Push.
  PushResult Push(const CapturedFrame& frame);
  // Until all frames pushed before the latest one have been tracked, or `is_stopped`. Where frames
  // are pushed no faster than that, none is dropped. Throws what a thread of the pipeline has
  // thrown.
  void WaitForTracking(const std::atomic<bool>& is_stopped);

  // Depth maps are made of no further keyframes, or of those that come from now on.
  void HoldModel(bool is_held) { flow_->is_held = is_held; }
  bool HasWaitingBundle() const { return flow_->has_waiting; }

  const CameraModel& camera() const { return lens_.camera(); }
  Pipeline& pipeline() { return *pipeline_; }

  // Of the frames tracked so far, from any thread.
  std::vector<TrajectoryEntry> Trajectory() const;  // as known now
  std::vector<TrajectoryEntry> OnlineTrajectory() const;
  std::int64_t num_tracked() const;
  std::optional<std::int64_t> first_tracked() const;  // index
  std::int64_t last_processed() const;                // index; -1: none
  std::uint64_t poses_version() const { return tracker_->Poses()->version(); }

  // Where the worlds of the maps lie in those of a run before. From any thread.
  void SetWorlds(WorldContinuation worlds);
  WorldContinuation worlds() const;

 private:
  void NoteTracked(const PipelineProgress& progress);
  void OnFrame(const PipelineProgress& progress);
  void OnDepthMap(const DepthMap& map, const FusionResult& fusion);
  PipelineObserver OwnObserver();

  CapturedFrameUndistorter lens_;
  PipelineObserver observer_;
  std::shared_ptr<BundleFlow> flow_ = std::make_shared<BundleFlow>();
  const Tracker* tracker_ = nullptr;  // the pipeline's

  mutable std::mutex mutex_;
  std::condition_variable tracked_;
  std::int64_t num_pushed_ = 0;
  std::int64_t num_processed_ = 0;
  std::vector<FramePose> poses_;
  std::vector<TrajectoryEntry> online_;
  std::optional<std::int64_t> first_tracked_;
  std::int64_t last_processed_ = -1;
  WorldContinuation worlds_;

  std::unique_ptr<Pipeline> pipeline_;  // its threads use the rest: ends first
};

}  // namespace mono3d
