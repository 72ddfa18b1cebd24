// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/model_builder.h"

#include <algorithm>
#include <exception>
#include <opencv2/core.hpp>
#include <utility>

#include "mono3d/pipeline/snapshot.h"
#include "pipeline/map_joins.h"
#include "pipeline/model_counts.h"
#include "pipeline/run_state.h"
#include "pipeline/state_parts.h"

namespace mono3d {
namespace {

constexpr const char* kModelState = "state of the model";
constexpr std::uint32_t kModelStateVersion = 3;
constexpr const char* kModelPart = "model";
// What seldom changes is written once: lists that grow, in pieces.
constexpr std::size_t kMembersPerSection = 256;

std::string SurfelsPart(int map_id) { return "surfels_" + std::to_string(map_id); }

DepthQuality QualityOf(const ImageBundle& bundle, const DepthResult& depth) {
  DepthQuality quality;
  quality.reference_id = bundle.reference().id;
  const DepthMap matched = WithoutInferred(depth.map);
  const cv::Mat& map = matched.depth;
  if (depth.status != DepthStatus::kEstimated || map.empty()) return quality;
  quality.density = static_cast<double>(CountEstimates(matched)) / static_cast<double>(map.total());
  const cv::Mat& confidence = matched.confidence;
  quality.confidence = confidence.empty() ? quality.density : cv::mean(confidence)[0];
  return quality;
}

// The latest attempt to fuse the depth map of this frame was successful.
bool WasFused(const std::vector<FusionRecord>& fusions, std::int64_t frame_index) {
  const auto latest =
      std::find_if(fusions.rbegin(), fusions.rend(),
                   [&](const FusionRecord& fusion) { return fusion.frame_index == frame_index; });
  return latest != fusions.rend() && latest->status == FusionStatus::kFused;
}

// The depth maps of a model that follows `poses`, fixed to their keyframes.
std::vector<FramePose> FixedToKeyframes(const std::vector<FusedDepthMap>& maps,
                                        const KeyframePoses& poses) {
  std::vector<FramePose> fixed;
  for (const FusedDepthMap& map : maps) {
    const KeyframePose* keyframe = poses.Find(map.keyframe_id);
    if (keyframe == nullptr) continue;
    fixed.push_back({map.frame_index, map.timestamp_s, map.keyframe_id,
                     keyframe->S_world_kf.Inverse() * map.S_world_kf.pose()});
  }
  return fixed;
}

template <typename T>
void Append(const std::vector<T>& more, std::vector<T>& list) {
  list.insert(list.end(), more.begin(), more.end());
}

}  // namespace

void ModelBuilder::Add(const EstimatedBundle& estimated, const KeyframePosesPtr& poses) {
  Update(poses);
  const ImageBundle& bundle = estimated.bundle;
  const KeyframePose* reference = poses->Find(bundle.reference().id);
  if (!estimated.depth || reference == nullptr) {
    ++counts_.rejected_bundles["its keyframes are not of one map"];
    return;
  }
  const DepthResult& depth = *estimated.depth;
  feedback_.qualities.push_back(QualityOf(bundle, depth));
  const int map_id = reference->map_id;
  OfMap& of_map = of_map_[map_id];
  of_map.matching.Add(depth);
  if (depth.status != DepthStatus::kEstimated) {
    CountReason(depth.reason, 1, counts_.rejected_bundles);
    JudgeHealth(bundle.reference().frame.index, of_map);
    return;
  }
  ++counts_.num_depth_maps;
  if (estimated.effort != DepthEffort::kFull) {
    ++counts_.reduced_depth_maps[ToString(estimated.effort)];
  }
  Fuse(depth.map, bundle.reference().frame, map_id);
}

void ModelBuilder::Fuse(const DepthMap& map, const Frame& reference, int map_id) {
  if (map_id != current_id_) {
    const auto left = surfel_maps_.find(current_id_);
    if (left != surfel_maps_.end()) left->second->Rest();
    current_id_ = map_id;
  }
  auto model = surfel_maps_.find(map_id);
  if (model == surfel_maps_.end()) {
    model = surfel_maps_.emplace(map_id, stages_.create_surfel_map()).first;
  }
  const FusionResult fusion = model->second->Integrate(map, *poses_);
  OfMap& of_map = of_map_[map_id];
  TakeResult(map, fusion, of_map);
  TakeRetried(fusion, of_map);
  publisher_.NoteChange();
  if (stages_.on_depth_map) stages_.on_depth_map(AtSizeOf(reference, map), fusion);
}

void ModelBuilder::TakeResult(const DepthMap& map, const FusionResult& fusion, OfMap& of_map) {
  if (fusion.status == FusionStatus::kFused) {
    ++counts_.num_fused;
  } else {
    CountReason(fusion.reason, 1, counts_.rejected_depth_maps);
  }
  of_map.fusions.push_back({map.frame_index, fusion.status, fusion.rejection, fusion.reason, false,
                            fusion.registration, fusion.starts_submap, fusion.is_repaired});
  counts_.num_repairs += fusion.is_repaired ? 1 : 0;
  counts_.num_submaps_started += fusion.starts_submap ? 1 : 0;
  for (const SubmapJoin& join : fusion.submap_joins) {
    counts_.num_submaps_joined += join.num_submaps;
    of_map.submap_joins.push_back(join);
  }
  counts_.num_constraints += static_cast<std::int64_t>(fusion.constraints.size());
  Append(fusion.constraints, feedback_.constraints);
  of_map.health_of_fusion = fusion.health;
  JudgeHealth(map.frame_index, of_map);
}

void ModelBuilder::JudgeHealth(std::int64_t frame_index, OfMap& of_map) {
  const HealthState before = of_map.health.state;
  of_map.health = of_map.matching.Judge(of_map.health_of_fusion);
  if (of_map.health.state == before) return;
  of_map.health_changes.push_back({frame_index, of_map.health.state, of_map.health.reason});
}

// Depth maps that came into the model later, or were taken out of it and did not come back.
void ModelBuilder::TakeRetried(const FusionResult& fusion, OfMap& of_map) {
  for (const RetriedMap& retried : fusion.retried) {
    const bool was_fused = WasFused(of_map.fusions, retried.frame_index);
    const bool is_fused = retried.status == FusionStatus::kFused;
    of_map.fusions.push_back({retried.frame_index, retried.status, FusionRejection::kNotRegistered,
                              "", true, retried.registration});
    counts_.num_fused += (is_fused ? 1 : 0) - (was_fused ? 1 : 0);
    counts_.num_fused_late += is_fused && !was_fused ? 1 : 0;
  }
}

void ModelBuilder::Update(const KeyframePosesPtr& poses) {
  if (poses == poses_) return;
  for (const MapJoin& join : FindMapJoins(*poses_, *poses)) Join(join, *poses);
  bool has_moved = false;
  for (const auto& [map_id, model] : surfel_maps_) {
    if (model->Update(*poses).has_moved) has_moved = true;
  }
  counts_.num_corrections += has_moved ? 1 : 0;
  if (has_moved) publisher_.NoteChange();
  poses_ = poses;
}

void ModelBuilder::Close(const KeyframePosesPtr& poses) {
  for (const MapJoin& join : FindMapJoins(*poses_, *poses)) JoinFinished(join);
  while (!surfel_maps_.empty()) Export(surfel_maps_.begin()->first);
  if (export_error_) std::rethrow_exception(std::exchange(export_error_, nullptr));
}

// Before what was put beside it.
void ModelBuilder::Export(int map_id) {
  const auto found = surfel_maps_.find(map_id);
  if (found == surfel_maps_.end()) return;
  // What cannot be exported once, for lack of memory or with a device that is lost, is not tried
  // again.
  const std::unique_ptr<SurfelMap> model = std::move(found->second);
  surfel_maps_.erase(found);
  OfMap& of_map = of_map_[map_id];
  const std::vector<FramePose> depth_maps = FixedToKeyframes(model->DepthMaps(), *poses_);
  Append(depth_maps, of_map.depth_maps);
  SurfelExportOptions options = stages_.surfel_export;
  const int max_observations = std::max(1, static_cast<int>(depth_maps.size()));
  options.min_observations = std::min(options.min_observations, max_observations);
  PointCloud cloud;
  try {
    cloud = model->ExportLast(options);
  } catch (...) {
    if (!export_error_) export_error_ = std::current_exception();
    cloud = LatestPublished(map_id);
  }
  AppendCloud(of_map.model, cloud);
  of_map.model = std::move(cloud);
}

// The model as it was some seconds ago; empty where nobody has watched it.
PointCloud ModelBuilder::LatestPublished(int map_id) {
  const PublishedModel latest = publisher_.Latest(0);
  if (latest.poses == nullptr || latest.map_id != map_id) return {};
  return ToPointCloud(latest.surfels);
}

void ModelBuilder::PublishIfDue() {
  const auto found = surfel_maps_.find(current_id_);
  if (found == surfel_maps_.end()) return;
  publisher_.PublishIfDue(*found->second, current_id_, poses_);
}

void ModelBuilder::Join(const MapJoin& join, const KeyframePoses& poses) {
  const auto from = surfel_maps_.find(join.from);
  if (from == surfel_maps_.end()) return JoinFinished(join);
  const bool is_new = surfel_maps_.count(join.into) == 0;
  std::unique_ptr<SurfelMap>& into = surfel_maps_[join.into];
  bool is_joined = false;
  try {
    if (is_new) into = stages_.create_surfel_map();
    is_joined = into->Join(*from->second, poses).has_value();
  } catch (...) {
    JoinFinished(join);  // what there was is not lost
    if (!into) surfel_maps_.erase(join.into);
    throw;
  }
  if (is_joined) {
    ++counts_.num_models_joined;
    surfel_maps_.erase(from);
  } else if (is_new) {
    surfel_maps_.erase(join.into);
  }
  JoinFinished(join);
}

// For a model that is finished: it is put beside the other one, as it is.
void ModelBuilder::JoinFinished(const MapJoin& join) {
  Export(join.from);
  JoinRecords(join);
}

void ModelBuilder::JoinRecords(const MapJoin& join) {
  OfMap from = std::move(of_map_[join.from]);
  of_map_.erase(join.from);
  OfMap& into = of_map_[join.into];
  AppendCloud(Moved(join.S_into_from, std::move(from.model)), into.model);
  Append(from.depth_maps, into.depth_maps);
  Append(from.fusions, into.fusions);
  Append(from.health_changes, into.health_changes);
  Append(from.submap_joins, into.submap_joins);
  if (current_id_ == join.from) {
    into.health = from.health;
    into.health_of_fusion = from.health_of_fusion;
    into.matching = from.matching;
    current_id_ = join.into;
  }
}

template <typename Archive>
void ModelBuilder::ExchangeState(Archive& archive, std::vector<int>& model_ids) {
  using mono3d::ExchangeState;
  ExchangeState(archive, counts_);
  archive.Number(current_id_);
  archive.List(model_ids, [&](int& map_id) { archive.Number(map_id); });
  ExchangeMap(
      archive, of_map_, [&](int& map_id) { archive.Number(map_id); },
      [&](OfMap& of_map) {
        const auto list = [&](auto& members) {
          archive.Sections(members, kMembersPerSection,
                           [&](auto& member) { ExchangeState(archive, member); });
        };
        ExchangeState(archive, of_map.model);
        list(of_map.depth_maps);
        list(of_map.fusions);
        ExchangeState(archive, of_map.health);
        list(of_map.health_changes);
        list(of_map.submap_joins);
        ExchangeState(archive, of_map.health_of_fusion);
        of_map.matching.Exchange(archive);
      });
  ExchangeState(archive, feedback_);
}

void ModelBuilder::SaveState(StateFolder& folder) {
  std::vector<int> model_ids;
  for (const auto& [map_id, model] : surfel_maps_) {
    model_ids.push_back(map_id);
    model->SaveState(folder, SurfelsPart(map_id));
  }
  StateWriter writer(kModelState, kModelStateVersion, SavedImages::kByIndex);
  ExchangeState(writer, model_ids);
  PutSections(folder, kModelPart, writer.TakeState());
}

void ModelBuilder::RestoreState(const StateFolder& folder, const KeyframePosesPtr& poses) {
  const std::string state = GetSections(folder, kModelPart);
  StateReader reader(state, kModelState, kModelStateVersion, folder.path().string(), {});
  std::vector<int> model_ids;
  ExchangeState(reader, model_ids);
  reader.CheckEnd();
  poses_ = poses;
  for (const int map_id : model_ids) {
    std::unique_ptr<SurfelMap> model = stages_.create_surfel_map();
    model->RestoreState(folder, SurfelsPart(map_id));
    surfel_maps_[map_id] = std::move(model);
  }
  publisher_.NoteChange();
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

}  // namespace mono3d
