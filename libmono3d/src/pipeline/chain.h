// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "mono3d/pipeline/pipeline.h"
#include "pipeline/model_worker.h"

namespace mono3d {

// From frames to models: the tracker, the choice of bundles, and the worker that makes models of
// them. Used by one thread at a time.
class Chain {
 public:
  Chain(std::unique_ptr<Tracker> tracker, std::unique_ptr<KeyframeSelector> keyframe_selector,
        std::unique_ptr<ModelWorker> worker);

  // Takes the frame through tracking and the choice of bundles; how far its bundle is then depends
  // on the worker.
  TrackingResult Process(const Frame& frame);

  // As Pipeline::Finish.
  [[nodiscard]] Reconstruction Finish();

  ModelProgress Progress() const;  // with all counts
  const Tracker& tracker() const { return *tracker_; }

 private:
  bool FeedBack();
  void TakePoses(const Frame& frame, const TrackingResult& tracking);
  void Update();
  void Select(const Keyframe& keyframe);
  void ProcessLast();
  MapReconstruction OfMap(int map_id, ModelBuilder::OfMap& made,
                          const std::vector<TrajectoryEntry>& trajectory,
                          const std::vector<TrajectoryEntry>& keyframes) const;

  std::unique_ptr<Tracker> tracker_;
  std::unique_ptr<KeyframeSelector> keyframe_selector_;
  std::unique_ptr<ModelWorker> worker_;
  PipelineCounts counts_;                                       // without those of the worker
  KeyframePosesPtr poses_ = std::make_shared<KeyframePoses>();  // of the last Update
  std::vector<TrajectoryEntry> online_trajectory_;
  bool has_thrown_ = false;  // a stage after the tracker: it would again
};

}  // namespace mono3d
