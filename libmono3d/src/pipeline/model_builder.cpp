// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/model_builder.h"

#include <algorithm>
#include <opencv2/core.hpp>
#include <utility>

namespace mono3d {
namespace {

DepthQuality WorthOf(const ImageBundle& bundle, const DepthResult& depth) {
  DepthQuality worth;
  worth.reference_id = bundle.reference().id;
  const cv::Mat& map = depth.map.depth;
  if (depth.status != DepthStatus::kEstimated || map.empty()) return worth;
  worth.density = static_cast<double>(CountEstimates(depth.map)) / static_cast<double>(map.total());
  const cv::Mat& confidence = depth.map.confidence;
  worth.confidence = confidence.empty() ? worth.density : cv::mean(confidence)[0];
  return worth;
}

}  // namespace

void ModelFeedback::Append(const ModelFeedback& more) {
  constraints.insert(constraints.end(), more.constraints.begin(), more.constraints.end());
  worths.insert(worths.end(), more.worths.begin(), more.worths.end());
}

void ModelBuilder::Add(const ImageBundle& bundle) {
  const DepthResult depth = stages_.depth_estimator->Estimate(bundle);
  feedback_.worths.push_back(WorthOf(bundle, depth));
  if (depth.status != DepthStatus::kEstimated) {
    ++counts_.rejected_bundles[ReasonClass(depth.reason)];
    return;
  }
  ++counts_.num_depth_maps;
  Fuse(depth.map);
}

void ModelBuilder::Fuse(const DepthMap& map) {
  if (map.map_id != current_id_) {
    const auto left = surfel_maps_.find(current_id_);
    if (left != surfel_maps_.end()) left->second->Rest();
    current_id_ = map.map_id;
  }
  std::unique_ptr<SurfelMap>& model = surfel_maps_[map.map_id];
  if (!model) model = stages_.create_surfel_map();
  scales_when_fused_[map.keyframe_id] = scales_.Of(map.keyframe_id);
  const FusionResult fusion = model->Integrate(map);
  TakeResult(map, fusion);
  TakeRetried(fusion);
  TakeConstraints(fusion);
  if (stages_.on_depth_map) stages_.on_depth_map(map, fusion);
}

void ModelBuilder::TakeResult(const DepthMap& map, const FusionResult& fusion) {
  OfMap& of_map = of_map_[map.map_id];
  if (fusion.status == FusionStatus::kFused) {
    ++counts_.num_fused;
    trajectory_.push_back({map.frame_index, map.timestamp_s, map.map_id, fusion.T_world_cam});
  } else {
    ++counts_.rejected_depth_maps[ReasonClass(fusion.reason)];
  }
  of_map.fusions.push_back({map.frame_index, fusion.status, fusion.reason, false,
                            fusion.registration, fusion.starts_submap, fusion.is_repaired});
  counts_.num_repairs += fusion.is_repaired ? 1 : 0;
  counts_.num_submaps_started += fusion.starts_submap ? 1 : 0;
  for (const SubmapJoin& join : fusion.submap_joins) {
    counts_.num_submaps_joined += join.num_submaps;
    TakeViews(map.map_id, join.views);
    of_map.submap_joins.push_back(join);
    of_map.submap_joins.back().views.clear();
  }
  if (fusion.health.state != of_map.health.state) {
    of_map.health_changes.push_back({map.frame_index, fusion.health.state, fusion.health.reason});
  }
  of_map.health = fusion.health;
}

// The model has lengths as they were when it was given the depth maps, the tracker as they were
// when it handed out the keyframes.
void ModelBuilder::TakeConstraints(const FusionResult& fusion) {
  const auto scale_of = [&](std::int64_t id) {
    const auto found = scales_when_fused_.find(id);
    return found == scales_when_fused_.end() ? 1 : found->second;
  };
  for (KeyframeConstraint constraint : fusion.constraints) {
    const double scale = scale_of(constraint.id);
    const double scale_of_anchor = scale_of(constraint.anchor_id);
    const Pose& T = constraint.T_cam_anchor;
    constraint.T_cam_anchor = Pose(T.rotation(), T.translation() / scale_of_anchor);
    constraint.scale *= scale / scale_of_anchor;
    Eigen::Matrix<double, 7, 1> unit = Eigen::Matrix<double, 7, 1>::Ones();
    unit.segment<3>(3).setConstant(scale_of_anchor);
    constraint.information = unit.asDiagonal() * constraint.information * unit.asDiagonal();
    feedback_.constraints.push_back(constraint);
  }
  counts_.num_constraints += static_cast<std::int64_t>(fusion.constraints.size());
}

void ModelBuilder::TakeViews(int map_id, const std::vector<MovedView>& views) {
  for (const MovedView& view : views) {
    for (TrajectoryEntry& entry : trajectory_) {
      if (entry.map_id != map_id || entry.frame_index != view.frame_index) continue;
      entry.T_world_cam = view.T_world_cam;
    }
  }
}

// Depth maps that came into the model later, or were taken out of it and did not come back.
void ModelBuilder::TakeRetried(const FusionResult& fusion) {
  for (const RetriedMap& retried : fusion.retried) {
    of_map_[current_id_].fusions.push_back(
        {retried.frame_index, retried.status, "", true, retried.registration});
    const auto known =
        std::find_if(trajectory_.begin(), trajectory_.end(), [&](const TrajectoryEntry& entry) {
          return entry.map_id == current_id_ && entry.frame_index == retried.frame_index;
        });
    const bool was_fused = known != trajectory_.end();
    if (was_fused) trajectory_.erase(known);
    if (retried.status != FusionStatus::kFused) {
      counts_.num_fused -= was_fused ? 1 : 0;
      continue;
    }
    const TrajectoryEntry entry = {retried.frame_index, retried.timestamp_s, current_id_,
                                   retried.T_world_cam};
    const auto place =
        std::find_if(trajectory_.begin(), trajectory_.end(), [&](const TrajectoryEntry& other) {
          return other.map_id == current_id_ && other.frame_index > retried.frame_index;
        });
    trajectory_.insert(place, entry);
    if (was_fused) continue;
    ++counts_.num_fused;
    ++counts_.num_fused_late;
  }
}

void ModelBuilder::Change(const MapChange& change) {
  if (change.corrections.empty()) return;
  scales_.Take(change.corrections);
  const std::vector<KeyframeCorrection> corrections = SinceFused(change.corrections);
  for (const JoinedMap& joined : change.joined) Join(joined, corrections);
  const int map_id = change.corrections.front().map_id;
  const auto model = surfel_maps_.find(map_id);
  if (model != surfel_maps_.end()) TakeViews(map_id, model->second->Correct(corrections).views);
}

// A model knows a keyframe from when its depth map came; keyframes without one it does not know.
std::vector<KeyframeCorrection> ModelBuilder::SinceFused(
    std::span<const KeyframeCorrection> corrections) const {
  std::vector<KeyframeCorrection> since_fused;
  for (KeyframeCorrection correction : corrections) {
    const auto fused = scales_when_fused_.find(correction.id);
    if (fused == scales_when_fused_.end()) continue;
    correction.scale /= fused->second;
    since_fused.push_back(correction);
  }
  return since_fused;
}

std::int64_t ModelBuilder::NumFused(int map_id) const {
  return std::count_if(trajectory_.begin(), trajectory_.end(),
                       [&](const TrajectoryEntry& entry) { return entry.map_id == map_id; });
}

void ModelBuilder::Close() {
  while (!surfel_maps_.empty()) Export(surfel_maps_.begin()->first);
}

// Before what was put beside it.
void ModelBuilder::Export(int map_id) {
  const auto found = surfel_maps_.find(map_id);
  if (found == surfel_maps_.end()) return;
  // What cannot be exported once, for lack of memory, is not tried again.
  const std::unique_ptr<SurfelMap> model = std::move(found->second);
  surfel_maps_.erase(found);
  const std::int64_t most_observations = std::max<std::int64_t>(1, NumFused(map_id));
  SurfelExportOptions options = stages_.surfel_export;
  options.min_observations =
      static_cast<int>(std::min<std::int64_t>(options.min_observations, most_observations));
  PointCloud cloud = model->Export(options);
  PointCloud& finished = of_map_[map_id].model;
  AppendCloud(finished, cloud);
  finished = std::move(cloud);
}

void ModelBuilder::Join(const JoinedMap& joined, std::span<const KeyframeCorrection> corrections) {
  const auto from = surfel_maps_.find(joined.from);
  if (from == surfel_maps_.end()) return JoinFinished({joined});
  const bool is_new = surfel_maps_.count(joined.into) == 0;
  std::unique_ptr<SurfelMap>& into = surfel_maps_[joined.into];
  if (is_new) into = stages_.create_surfel_map();
  std::optional<CorrectionResult> result;
  try {
    result = into->Join(*from->second, {joined.into, joined.S_into_from, corrections});
  } catch (...) {
    JoinFinished({joined});  // what there was is not lost
    throw;
  }
  if (result) {
    ++counts_.num_models_joined;
    surfel_maps_.erase(from);
  } else if (is_new) {
    surfel_maps_.erase(joined.into);
  }
  JoinFinished({joined});
  if (result) TakeViews(joined.into, result->views);
}

void ModelBuilder::JoinFinished(const std::vector<JoinedMap>& joined_maps) {
  for (const JoinedMap& joined : joined_maps) {
    Export(joined.from);
    JoinRecords(joined);
    MoveEntries(joined, trajectory_);
  }
}

void ModelBuilder::JoinRecords(const JoinedMap& joined) {
  OfMap from = std::move(of_map_[joined.from]);
  of_map_.erase(joined.from);
  OfMap& into = of_map_[joined.into];
  AppendCloud(Moved(joined.S_into_from, std::move(from.model)), into.model);
  const auto append = [](auto& to, const auto& more) {
    to.insert(to.end(), more.begin(), more.end());
  };
  append(into.fusions, from.fusions);
  append(into.health_changes, from.health_changes);
  append(into.submap_joins, from.submap_joins);
  if (current_id_ == joined.from) {
    into.health = from.health;
    current_id_ = joined.into;
  }
}

ModelProgress ModelBuilder::Progress() const {
  ModelProgress progress;
  progress.counts = counts_;
  const auto model = surfel_maps_.find(current_id_);
  progress.num_surfels = model == surfel_maps_.end() ? 0 : model->second->num_surfels();
  const auto of_map = of_map_.find(current_id_);
  if (of_map != of_map_.end()) progress.health = of_map->second.health;
  return progress;
}

void AddModelCounts(const PipelineCounts& model, PipelineCounts& counts) {
  counts.num_depth_maps += model.num_depth_maps;
  counts.num_fused += model.num_fused;
  counts.num_fused_late += model.num_fused_late;
  counts.num_repairs += model.num_repairs;
  counts.num_submaps_started += model.num_submaps_started;
  counts.num_submaps_joined += model.num_submaps_joined;
  counts.num_models_joined += model.num_models_joined;
  counts.num_constraints += model.num_constraints;
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
