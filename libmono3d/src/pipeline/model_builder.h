// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "mono3d/core/state_folder.h"
#include "mono3d/image/keyframe_poses.h"
#include "mono3d/pipeline/pipeline.h"
#include "pipeline/bundle_matching.h"
#include "pipeline/depth_thread.h"
#include "pipeline/model_feedback.h"
#include "pipeline/model_publisher.h"

namespace mono3d {

// The stages that make the model from depth maps.
struct ModelStages {
  std::function<std::unique_ptr<SurfelMap>()> create_surfel_map;
  std::function<void(const DepthMap&, const FusionResult&)> on_depth_map;  // may be empty
  SurfelExportOptions surfel_export;
};

// How far the model is.
struct ModelProgress {
  PipelineCounts counts;  // of bundles, depth maps and the model; the rest is 0
  std::int64_t num_surfels = 0;
  ModelHealth health;
};

// The end of the chain: from the depth maps of bundles to the models of the tracker's maps. Used by
// one thread at a time.
class ModelBuilder {
 public:
  explicit ModelBuilder(ModelStages stages) : stages_(std::move(stages)) {}

  // The depth map into the model of its map, after Update(poses). `poses`: those of the estimate or
  // newer ones.
  void Add(const EstimatedBundle& estimated, const KeyframePosesPtr& poses);
  // The models follow their keyframes. Where the tracker has made one map of two, one model is made
  // of theirs.
  void Update(const KeyframePosesPtr& poses);
  // Exports the models, at the poses of the last Update, and lets their memory go. Maps that have
  // become one since then have their models put side by side. Throws, at the end, what the first
  // export threw that failed: of that model there is then what was published last.
  void Close(const KeyframePosesPtr& poses);

  // Publishes the current model for who watches it, if that is due.
  void PublishIfDue();
  ModelPublisher& publisher() { return publisher_; }

  // What there is to tell the stages before since the last call.
  ModelFeedback TakeFeedback() { return std::exchange(feedback_, {}); }

  ModelProgress Progress() const;
  const KeyframePosesPtr& poses() const { return poses_; }  // of the last Update

  // What there is of one map of the tracker; the model and its depth maps after Close.
  struct OfMap {
    PointCloud model;
    std::vector<FramePose> depth_maps;  // fused ones
    std::vector<FusionRecord> fusions;
    ModelHealth health;
    std::vector<HealthChange> health_changes;
    std::vector<SubmapJoin> submap_joins;
    ModelHealth health_of_fusion;  // as its registrations tell
    BundleMatching matching;
  };
  OfMap& Of(int map_id) { return of_map_[map_id]; }

  // Into the save that is being made: all there is before Close. What is published is none of it.
  void SaveState(StateFolder& folder);
  // Before the first Add: goes on as the builder of the same stages did that was saved, whose poses
  // of the last Update were `poses`. Throws Error on a state that is damaged.
  void RestoreState(const StateFolder& folder, const KeyframePosesPtr& poses);

 private:
  void Fuse(const DepthMap& map, const Frame& reference, int map_id);
  void TakeResult(const DepthMap& map, const FusionResult& fusion, OfMap& of_map);
  void TakeRetried(const FusionResult& fusion, OfMap& of_map);
  static void JudgeHealth(std::int64_t frame_index, OfMap& of_map);
  void Join(const MapJoin& join, const KeyframePoses& poses);
  void JoinFinished(const MapJoin& join);
  void JoinRecords(const MapJoin& join);
  void Export(int map_id);
  PointCloud LatestPublished(int map_id);
  template <typename Archive>
  void ExchangeState(Archive& archive, std::vector<int>& model_ids);

  ModelStages stages_;
  PipelineCounts counts_;
  KeyframePosesPtr poses_ = std::make_shared<KeyframePoses>();  // of the last Update
  std::map<int, std::unique_ptr<SurfelMap>> surfel_maps_;       // by map of the tracker
  int current_id_ = 0;                                          // the map in use
  std::map<int, OfMap> of_map_;
  ModelFeedback feedback_;
  ModelPublisher publisher_;
  std::exception_ptr export_error_;  // the first one
};

}  // namespace mono3d
