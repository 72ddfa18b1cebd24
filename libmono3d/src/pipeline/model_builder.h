// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "mono3d/image/keyframe_constraint.h"
#include "mono3d/pipeline/pipeline.h"
#include "pipeline/keyframe_scales.h"
#include "pipeline/map_joins.h"

namespace mono3d {

// The stages that make the model from bundles; by one thread at a time.
struct ModelStages {
  std::unique_ptr<DepthEstimator> depth_estimator;
  std::function<std::unique_ptr<SurfelMap>()> create_surfel_map;
  std::function<void(const DepthMap&, const FusionResult&)> on_depth_map;  // may be empty
  SurfelExportOptions surfel_export;
};

// How far the model is.
struct ModelProgress {
  PipelineCounts counts;  // of depth maps and the model; the rest is 0
  std::int64_t num_surfels = 0;
  ModelHealth health;
};

// What the stages before are told.
struct ModelFeedback {
  std::vector<KeyframeConstraint>
      constraints;                   // where models have keyframes, in the tracker's terms
  std::vector<DepthQuality> worths;  // what became of bundles

  void Append(const ModelFeedback& more);
};

// The second half of the chain: from bundles to depth maps to the models of the tracker's maps.
class ModelBuilder {
 public:
  explicit ModelBuilder(ModelStages stages) : stages_(std::move(stages)) {}

  // A depth map from the bundle, and it into the model of its map.
  void Add(const ImageBundle& bundle);
  // Keyframes were moved: what is in the models moves along. Where the tracker has made one map of
  // two, one model is made of theirs.
  void Change(const MapChange& change);
  // The same for models that are finished: they are put side by side, as they are.
  void JoinFinished(const std::vector<JoinedMap>& joined);
  // Exports the models and lets their memory go.
  void Close();

  // What there is to tell the stages before since the last call.
  ModelFeedback TakeFeedback() { return std::exchange(feedback_, {}); }

  ModelProgress Progress() const;
  const std::vector<TrajectoryEntry>& trajectory() const { return trajectory_; }  // fused maps
  // What there is of one map of the tracker; the model after Close.
  struct OfMap {
    PointCloud model;
    std::vector<FusionRecord> fusions;
    ModelHealth health;
    std::vector<HealthChange> health_changes;
    std::vector<SubmapJoin> submap_joins;
  };
  OfMap& Of(int map_id) { return of_map_[map_id]; }

 private:
  void Fuse(const DepthMap& map);
  void TakeResult(const DepthMap& map, const FusionResult& fusion);
  void TakeRetried(const FusionResult& fusion);
  void TakeConstraints(const FusionResult& fusion);
  void TakeViews(int map_id, const std::vector<MovedView>& views);
  void Join(const JoinedMap& joined, std::span<const KeyframeCorrection> corrections);
  void JoinRecords(const JoinedMap& joined);
  void Export(int map_id);
  std::vector<KeyframeCorrection> SinceFused(std::span<const KeyframeCorrection> corrections) const;
  std::int64_t NumFused(int map_id) const;

  ModelStages stages_;
  PipelineCounts counts_;
  std::vector<TrajectoryEntry> trajectory_;
  std::map<int, std::unique_ptr<SurfelMap>> surfel_maps_;  // by map of the tracker
  int current_id_ = 0;                                     // the map in use
  std::map<int, OfMap> of_map_;
  KeyframeScales scales_;
  std::map<std::int64_t, double> scales_when_fused_;  // by keyframe
  ModelFeedback feedback_;
};

// Adds the counts of depth maps and the model.
void AddModelCounts(const PipelineCounts& model, PipelineCounts& counts);

// The reason without its figures, so that equal causes are counted together: "62 matches, 100
// needed" and "63 matches, 100 needed" become "# matches, # needed".
std::string ReasonClass(const std::string& reason);

}  // namespace mono3d
