// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/model_builder.h"

#include <algorithm>
#include <utility>

namespace mono3d {

void ModelBuilder::Add(const ImageBundle& bundle) {
  const DepthResult depth = stages_.depth_estimator->Estimate(bundle);
  if (depth.status != DepthStatus::kEstimated) {
    ++counts_.rejected_bundles[ReasonClass(depth.reason)];
    return;
  }
  ++counts_.num_depth_maps;
  Fuse(depth.map);
}

void ModelBuilder::Fuse(const DepthMap& map) {
  if (surfel_map_ && surfel_map_id_ != map.map_id) Close();
  if (!surfel_map_) {
    surfel_map_ = stages_.create_surfel_map();
    surfel_map_id_ = map.map_id;
  }
  scales_when_fused_[map.keyframe_id] = scales_.Of(map.keyframe_id);
  const FusionResult fusion = surfel_map_->Integrate(map);
  if (fusion.status == FusionStatus::kFused) {
    ++counts_.num_fused;
    trajectory_.push_back({map.frame_index, map.timestamp_s, map.map_id, fusion.T_world_cam});
  } else {
    ++counts_.rejected_depth_maps[ReasonClass(fusion.reason)];
  }
  fusions_[map.map_id].push_back(
      {map.frame_index, fusion.status, fusion.reason, false, fusion.registration});
  TakeRetried(fusion);
  health_[map.map_id] = fusion.health;
  if (stages_.on_depth_map) stages_.on_depth_map(map, fusion);
}

// Depth maps that came into the model later, or were taken out of it and did not come back.
void ModelBuilder::TakeRetried(const FusionResult& fusion) {
  counts_.num_repairs += fusion.is_repaired ? 1 : 0;
  for (const RetriedMap& retried : fusion.retried) {
    fusions_[surfel_map_id_].push_back(
        {retried.frame_index, retried.status, "", true, retried.registration});
    const auto known =
        std::find_if(trajectory_.begin(), trajectory_.end(), [&](const TrajectoryEntry& entry) {
          return entry.map_id == surfel_map_id_ && entry.frame_index == retried.frame_index;
        });
    const bool was_fused = known != trajectory_.end();
    if (was_fused) trajectory_.erase(known);
    if (retried.status != FusionStatus::kFused) {
      counts_.num_fused -= was_fused ? 1 : 0;
      continue;
    }
    const TrajectoryEntry entry = {retried.frame_index, retried.timestamp_s, surfel_map_id_,
                                   retried.T_world_cam};
    const auto place =
        std::find_if(trajectory_.begin(), trajectory_.end(), [&](const TrajectoryEntry& other) {
          return other.map_id == surfel_map_id_ && other.frame_index > retried.frame_index;
        });
    trajectory_.insert(place, entry);
    if (was_fused) continue;
    ++counts_.num_fused;
    ++counts_.num_fused_late;
  }
}

void ModelBuilder::Correct(const std::vector<KeyframeCorrection>& corrections) {
  if (corrections.empty()) return;
  scales_.Take(corrections);
  if (!surfel_map_ || surfel_map_id_ != corrections.front().map_id) return;
  // The model knows a keyframe from when its depth map was fused.
  std::vector<KeyframeCorrection> since_fused = corrections;
  for (KeyframeCorrection& correction : since_fused) {
    const auto fused = scales_when_fused_.find(correction.id);
    if (fused != scales_when_fused_.end()) correction.scale /= fused->second;
  }
  const CorrectionResult result = surfel_map_->Correct(since_fused);
  for (const MovedView& view : result.views) {
    for (TrajectoryEntry& entry : trajectory_) {
      if (entry.map_id != surfel_map_id_ || entry.frame_index != view.frame_index) continue;
      entry.T_world_cam = view.T_world_cam;
    }
  }
}

std::int64_t ModelBuilder::NumFused(int map_id) const {
  return std::count_if(trajectory_.begin(), trajectory_.end(),
                       [&](const TrajectoryEntry& entry) { return entry.map_id == map_id; });
}

void ModelBuilder::Close() {
  if (!surfel_map_) return;
  const std::int64_t most_observations = std::max<std::int64_t>(1, NumFused(surfel_map_id_));
  SurfelExportOptions options = stages_.surfel_export;
  options.min_observations =
      static_cast<int>(std::min<std::int64_t>(options.min_observations, most_observations));
  // A map may have been left for another one and come into use again.
  AppendCloud(surfel_map_->Export(options), finished_models_[surfel_map_id_]);
  surfel_map_.reset();
}

void ModelBuilder::Join(const std::vector<JoinedMap>& joined_maps) {
  for (const JoinedMap& joined : joined_maps) {
    if (surfel_map_ && surfel_map_id_ == joined.from) Close();
    AppendCloud(Moved(joined.S_into_from, std::move(finished_models_[joined.from])),
                finished_models_[joined.into]);
    finished_models_.erase(joined.from);
    std::vector<FusionRecord>& of_joined = fusions_[joined.into];
    of_joined.insert(of_joined.end(), fusions_[joined.from].begin(), fusions_[joined.from].end());
    fusions_.erase(joined.from);
    MoveEntries(joined, trajectory_);
  }
}

ModelProgress ModelBuilder::Progress() const {
  ModelProgress progress;
  progress.counts = counts_;
  progress.num_surfels = surfel_map_ ? surfel_map_->num_surfels() : 0;
  const auto health = health_.find(surfel_map_id_);
  if (health != health_.end()) progress.health = health->second;
  return progress;
}

void AddModelCounts(const PipelineCounts& model, PipelineCounts& counts) {
  counts.num_depth_maps += model.num_depth_maps;
  counts.num_fused += model.num_fused;
  counts.num_fused_late += model.num_fused_late;
  counts.num_repairs += model.num_repairs;
  for (const auto& [reason, times] : model.rejected_bundles) {
    counts.rejected_bundles[reason] += times;
  }
  for (const auto& [reason, times] : model.rejected_depth_maps) {
    counts.rejected_depth_maps[reason] += times;
  }
}

std::string ReasonClass(const std::string& reason) {
  std::string result;
  bool in_number = false;
  for (const char c : reason) {
    const bool is_digit = c >= '0' && c <= '9';
    if (is_digit || (in_number && c == '.')) {
      if (!in_number) result += '#';
      in_number = true;
    } else {
      in_number = false;
      result += c;
    }
  }
  return result.empty() ? "no reason given" : result;
}

}  // namespace mono3d
