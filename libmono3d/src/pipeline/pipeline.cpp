// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/pipeline/pipeline.h"

#include <algorithm>
#include <utility>

#include "pipeline/map_joins.h"

namespace mono3d {
namespace {

// The reason without its figures, so that equal causes are counted together: "62 matches, 100
// needed" and "63 matches, 100 needed" become "# matches, # needed".
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

// The entries of one map.
std::vector<TrajectoryEntry> OfMap(const std::vector<TrajectoryEntry>& entries, int map_id) {
  std::vector<TrajectoryEntry> selected;
  std::copy_if(entries.begin(), entries.end(), std::back_inserter(selected),
               [&](const TrajectoryEntry& entry) { return entry.map_id == map_id; });
  return selected;
}

}  // namespace

struct Pipeline::State {
  PipelineStages stages;
  PipelineObserver observer;
  SurfelExportOptions surfel_export;

  PipelineCounts counts;
  std::vector<TrajectoryEntry> online_trajectory;
  std::vector<TrajectoryEntry> model_trajectory;
  std::unique_ptr<SurfelMap> surfel_map;  // of the current map
  int surfel_map_id = 0;
  std::map<int, PointCloud> finished_models;
  std::map<int, std::vector<FusionRecord>> fusions;
  std::map<int, ModelHealth> health;
  MapJoins joins;
  bool has_thrown = false;  // a stage after the tracker: it would again

  void ProcessKeyframe(const Keyframe& keyframe);
  void Fuse(const DepthMap& map);
  void TakeRetried(const FusionResult& fusion);
  void Correct(const std::vector<KeyframeCorrection>& corrections);
  void CloseModel();
  void JoinModels(const std::vector<KeyframeCorrection>& corrections);
  std::int64_t NumFused(int map_id) const;
};

void Pipeline::State::ProcessKeyframe(const Keyframe& keyframe) {
  ++counts.num_keyframes;
  joins.Remember(keyframe);
  const std::optional<ImageBundle> bundle = stages.keyframe_selector->Add(keyframe);
  if (!bundle) return;
  ++counts.num_bundles;
  const DepthResult depth = stages.depth_estimator->Estimate(*bundle);
  if (depth.status != DepthStatus::kEstimated) {
    ++counts.rejected_bundles[ReasonClass(depth.reason)];
    return;
  }
  ++counts.num_depth_maps;
  Fuse(depth.map);
}

void Pipeline::State::Fuse(const DepthMap& map) {
  if (surfel_map && surfel_map_id != map.map_id) CloseModel();
  if (!surfel_map) {
    surfel_map = stages.create_surfel_map();
    surfel_map_id = map.map_id;
  }
  const FusionResult fusion = surfel_map->Integrate(map);
  if (fusion.status == FusionStatus::kFused) {
    ++counts.num_fused;
    model_trajectory.push_back({map.frame_index, map.timestamp_s, map.map_id, fusion.T_world_cam});
  } else {
    ++counts.rejected_depth_maps[ReasonClass(fusion.reason)];
  }
  fusions[map.map_id].push_back(
      {map.frame_index, fusion.status, fusion.reason, false, fusion.registration});
  TakeRetried(fusion);
  health[map.map_id] = fusion.health;
  if (observer.on_depth_map) observer.on_depth_map(map, fusion);
}

// Depth maps that came into the model later, or were taken out of it and did not come back.
void Pipeline::State::TakeRetried(const FusionResult& fusion) {
  counts.num_repairs += fusion.is_repaired ? 1 : 0;
  for (const RetriedMap& retried : fusion.retried) {
    fusions[surfel_map_id].push_back(
        {retried.frame_index, retried.status, "", true, retried.registration});
    const auto known = std::find_if(
        model_trajectory.begin(), model_trajectory.end(), [&](const TrajectoryEntry& entry) {
          return entry.map_id == surfel_map_id && entry.frame_index == retried.frame_index;
        });
    const bool was_fused = known != model_trajectory.end();
    if (was_fused) model_trajectory.erase(known);
    if (retried.status != FusionStatus::kFused) {
      counts.num_fused -= was_fused ? 1 : 0;
      continue;
    }
    const TrajectoryEntry entry = {retried.frame_index, retried.timestamp_s, surfel_map_id,
                                   retried.T_world_cam};
    const auto place = std::find_if(
        model_trajectory.begin(), model_trajectory.end(), [&](const TrajectoryEntry& other) {
          return other.map_id == surfel_map_id && other.frame_index > retried.frame_index;
        });
    model_trajectory.insert(place, entry);
    if (was_fused) continue;
    ++counts.num_fused;
    ++counts.num_fused_late;
  }
}

// A loop was closed: what waits in the selector and what is in the model moves with its keyframes.
void Pipeline::State::Correct(const std::vector<KeyframeCorrection>& corrections) {
  if (corrections.empty()) return;
  ++counts.num_corrections;
  stages.keyframe_selector->Correct(corrections);
  if (!surfel_map || surfel_map_id != corrections.front().map_id) return;
  const CorrectionResult result = surfel_map->Correct(corrections);
  for (const MovedView& view : result.views) {
    for (TrajectoryEntry& entry : model_trajectory) {
      if (entry.map_id != surfel_map_id || entry.frame_index != view.frame_index) continue;
      entry.T_world_cam = view.T_world_cam;
    }
  }
}

std::int64_t Pipeline::State::NumFused(int map_id) const {
  return std::count_if(model_trajectory.begin(), model_trajectory.end(),
                       [&](const TrajectoryEntry& entry) { return entry.map_id == map_id; });
}

// Exports the model of the current map and lets its memory go.
void Pipeline::State::CloseModel() {
  if (!surfel_map) return;
  const std::int64_t most_observations = std::max<std::int64_t>(1, NumFused(surfel_map_id));
  SurfelExportOptions options = surfel_export;
  options.min_observations =
      static_cast<int>(std::min<std::int64_t>(options.min_observations, most_observations));
  // A map may have been left for another one and come into use again.
  AppendCloud(surfel_map->Export(options), finished_models[surfel_map_id]);
  surfel_map.reset();
}

// Where the tracker has made one map of two, their models are parts of one model.
void Pipeline::State::JoinModels(const std::vector<KeyframeCorrection>& corrections) {
  for (const JoinedMap& joined : joins.Take(corrections)) {
    if (surfel_map && surfel_map_id == joined.from) CloseModel();
    AppendCloud(Moved(joined.S_into_from, std::move(finished_models[joined.from])),
                finished_models[joined.into]);
    finished_models.erase(joined.from);
    std::vector<FusionRecord>& of_joined = fusions[joined.into];
    of_joined.insert(of_joined.end(), fusions[joined.from].begin(), fusions[joined.from].end());
    fusions.erase(joined.from);
    MoveEntries(joined, online_trajectory);
    MoveEntries(joined, model_trajectory);
  }
}

Pipeline::Pipeline(PipelineStages stages, PipelineObserver observer,
                   const SurfelExportOptions& surfel_export)
    : state_(std::make_unique<State>()) {
  state_->stages = std::move(stages);
  state_->observer = std::move(observer);
  state_->surfel_export = surfel_export;
}

Pipeline::~Pipeline() = default;

void Pipeline::Process(const Frame& frame) {
  State& state = *state_;
  ++state.counts.num_frames;
  const TrackingResult tracking = state.stages.tracker->Track(frame);
  state.JoinModels(tracking.corrections);
  if (tracking.T_world_cam) {
    ++state.counts.num_tracked;
    state.online_trajectory.push_back(
        {frame.index, frame.timestamp_s, tracking.map_id, *tracking.T_world_cam});
  } else {
    ++state.counts.untracked_frames[ReasonClass(tracking.reason)];
  }
  state.counts.num_recovered += static_cast<std::int64_t>(tracking.recovered.size());
  state.online_trajectory.insert(state.online_trajectory.end(), tracking.recovered.begin(),
                                 tracking.recovered.end());
  state.has_thrown = true;
  state.Correct(tracking.corrections);
  for (const Keyframe& keyframe : tracking.settled_keyframes) state.ProcessKeyframe(keyframe);
  state.has_thrown = false;
  if (state.observer.on_frame) {
    state.observer.on_frame({state.counts, tracking,
                             state.surfel_map ? state.surfel_map->num_surfels() : 0,
                             state.health[state.surfel_map_id]});
  }
}

Reconstruction Pipeline::Finish() {
  State& state = *state_;
  const std::vector<KeyframeCorrection> corrections = state.stages.tracker->WaitForMapping();
  state.JoinModels(corrections);
  const std::vector<Keyframe> last_keyframes = state.stages.tracker->Finish();
  if (!state.has_thrown) {
    state.Correct(corrections);
    for (const Keyframe& keyframe : last_keyframes) state.ProcessKeyframe(keyframe);
  }
  state.CloseModel();

  const std::vector<TrajectoryEntry> trajectory = state.stages.tracker->Trajectory();
  const std::vector<TrajectoryEntry> keyframes = state.stages.tracker->KeyframeTrajectory();
  std::map<int, std::int64_t> num_frames_of_map;
  for (const TrajectoryEntry& entry : trajectory) ++num_frames_of_map[entry.map_id];

  std::stable_sort(state.online_trajectory.begin(), state.online_trajectory.end(),
                   [](const TrajectoryEntry& a, const TrajectoryEntry& b) {
                     return a.frame_index < b.frame_index;
                   });
  Reconstruction result;
  for (const auto& [map_id, num_frames] : num_frames_of_map) {
    result.maps.push_back(
        {map_id, OfMap(trajectory, map_id), OfMap(state.online_trajectory, map_id),
         OfMap(keyframes, map_id), OfMap(state.model_trajectory, map_id),
         std::move(state.finished_models[map_id]), state.stages.tracker->Sparse(map_id),
         std::move(state.fusions[map_id]), state.health[map_id]});
  }
  std::stable_sort(result.maps.begin(), result.maps.end(),
                   [](const MapReconstruction& a, const MapReconstruction& b) {
                     return a.trajectory.size() > b.trajectory.size();
                   });
  result.counts = state.counts;
  return result;
}

const Tracker& Pipeline::tracker() const { return *state_->stages.tracker; }

Reconstruction Pipeline::Run(FrameSource& source, const std::atomic<bool>* stop) {
  while (stop == nullptr || !stop->load()) {
    const std::optional<Frame> frame = source.Next();
    if (!frame) break;
    Process(*frame);
  }
  return Finish();
}

}  // namespace mono3d
