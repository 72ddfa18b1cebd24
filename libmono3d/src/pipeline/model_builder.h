// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

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

// The second half of the chain: from bundles to depth maps to the models of the tracker's maps.
class ModelBuilder {
 public:
  explicit ModelBuilder(ModelStages stages) : stages_(std::move(stages)) {}

  // A depth map from the bundle, and it into the model of its map.
  void Add(const ImageBundle& bundle);
  // Keyframes were moved: what is in the model moves along.
  void Correct(const std::vector<KeyframeCorrection>& corrections);
  // Where the tracker has made one map of two, their models are parts of one model.
  void Join(const std::vector<JoinedMap>& joined);
  // Exports the model of the current map and lets its memory go.
  void Close();

  ModelProgress Progress() const;
  const std::vector<TrajectoryEntry>& trajectory() const { return trajectory_; }  // fused maps
  // After Close, of one map of the tracker; empty where it has none.
  PointCloud& Model(int map_id) { return finished_models_[map_id]; }
  std::vector<FusionRecord>& Fusions(int map_id) { return fusions_[map_id]; }
  const ModelHealth& Health(int map_id) { return health_[map_id]; }

 private:
  void Fuse(const DepthMap& map);
  void TakeRetried(const FusionResult& fusion);
  std::int64_t NumFused(int map_id) const;

  ModelStages stages_;
  PipelineCounts counts_;
  std::vector<TrajectoryEntry> trajectory_;
  std::unique_ptr<SurfelMap> surfel_map_;  // of the current map
  int surfel_map_id_ = 0;
  std::map<int, PointCloud> finished_models_;
  std::map<int, std::vector<FusionRecord>> fusions_;
  std::map<int, ModelHealth> health_;
  KeyframeScales scales_;
  std::map<std::int64_t, double> scales_when_fused_;  // by keyframe
};

// Adds the counts of depth maps and the model.
void AddModelCounts(const PipelineCounts& model, PipelineCounts& counts);

// The reason without its figures, so that equal causes are counted together: "62 matches, 100
// needed" and "63 matches, 100 needed" become "# matches, # needed".
std::string ReasonClass(const std::string& reason);

}  // namespace mono3d
