// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "mono3d/core/state_folder.h"
#include "mono3d/image/frame_images.h"
#include "mono3d/pipeline/pipeline.h"
#include "pipeline/model_worker.h"
#include "pipeline/position_feed.h"

namespace mono3d {

// From frames to models: the tracker, the choice of bundles, and the worker that makes models of
// them. Used by one thread at a time, but for
// Snapshot and State.
class Chain {
 public:
  // `on_keyframe` may be empty. Of the options, the positions and the pace count.
  Chain(std::unique_ptr<Tracker> tracker, std::unique_ptr<KeyframeSelector> keyframe_selector,
        std::unique_ptr<ModelWorker> worker, std::function<void(const Keyframe&)> on_keyframe,
        const PipelineOptions& options);

  // Takes the frame through tracking and the choice of bundles; how far its bundle is then depends
  // on the worker.
  TrackingResult Process(const Frame& frame);

  // As Pipeline::Finish.
  [[nodiscard]] Reconstruction Finish();

  // As Pipeline::GivePositions. From any thread.
  void GivePositions(PositionTrack track);

  // The worker has failed: Finish does not ask it for more.
  void Abandon() { has_thrown_ = true; }

  // As Pipeline's; between two calls of Process.
  void SaveState(StateFolder& folder, const std::function<void()>& at_rest);
  void RestoreState(const StateFolder& folder, const ImageOfFrame& images);
  static std::vector<std::int64_t> FramesOfState(const StateFolder& folder);

  // As Pipeline::Snapshot, and that without surfels. From any thread.
  PipelineSnapshot Snapshot(std::uint64_t since_version) const;
  PipelineSnapshot State() const;

  const Tracker& tracker() const { return *tracker_; }

 private:
  bool FeedBack();
  std::size_t NumKeyframesOf(int map_id) const;
  void FollowPositions(const TrackingResult& tracking);
  void FollowAllPositions();
  void TakePoses(const Frame& frame, const TrackingResult& tracking);
  void TakeLateResults();
  void TakeCounts();
  void Publish(const Frame& frame, const TrackingResult& tracking);
  void Update();
  void Select(const Keyframe& from_tracker);
  void AddBundle(ImageBundle bundle);
  bool IsStopped() const;
  void ProcessLast();
  template <typename Archive>
  void ExchangeState(Archive& archive);
  MapReconstruction OfMap(int map_id, ModelBuilder::OfMap& made,
                          const std::vector<TrajectoryEntry>& trajectory,
                          const std::vector<TrajectoryEntry>& keyframes) const;

  std::unique_ptr<Tracker> tracker_;
  std::unique_ptr<KeyframeSelector> keyframe_selector_;
  std::unique_ptr<ModelWorker> worker_;
  std::function<void(const Keyframe&)> on_keyframe_;
  std::optional<PositionFeed> positions_;
  bool is_live_;
  const std::atomic<bool>* stop_;  // PhotoMapperOptions::stop; may be null
  PipelineCounts counts_;          // without those of the worker
  KeyframePosesPtr poses_ = std::make_shared<KeyframePoses>();  // of the last Update
  std::vector<TrajectoryEntry> online_trajectory_;
  std::map<std::int64_t, std::string> unplaced_photos_;  // by the index of the frame: why
  // The selector's images are others than the tracker's: of a global shutter.
  bool has_changed_images_ = false;
  bool has_thrown_ = false;  // a stage after the tracker: it would again

  // For Snapshot: of the latest frame, its pose fixed to its keyframe, and counts_ as of then.
  struct Latest {
    PipelineSnapshot snapshot;
    std::optional<FramePose> pose;
  };
  mutable std::mutex mutex_;
  Latest latest_;
};

}  // namespace mono3d
