// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/pipeline/pipeline.h"

#include <algorithm>
#include <string>
#include <utility>

#include "core/out_of_memory.h"
#include "pipeline/map_joins.h"
#include "pipeline/model_builder.h"
#include "pipeline/model_thread.h"

namespace mono3d {
namespace {

// The entries of one map.
std::vector<TrajectoryEntry> OfMap(const std::vector<TrajectoryEntry>& entries, int map_id) {
  std::vector<TrajectoryEntry> selected;
  std::copy_if(entries.begin(), entries.end(), std::back_inserter(selected),
               [&](const TrajectoryEntry& entry) { return entry.map_id == map_id; });
  return selected;
}

}  // namespace

struct Pipeline::State {
  std::unique_ptr<Tracker> tracker;
  std::unique_ptr<KeyframeSelector> keyframe_selector;
  std::function<void(const PipelineProgress&)> on_frame;
  ModelBuilder builder;
  PipelineCounts counts;  // without those of the builder
  std::vector<TrajectoryEntry> online_trajectory;
  MapJoins joins;
  bool has_thrown = false;              // a stage after the tracker: it would again
  std::unique_ptr<ModelThread> thread;  // live only; ends first

  State(PipelineStages stages, PipelineObserver observer, const SurfelExportOptions& surfel_export)
      : tracker(std::move(stages.tracker)),
        keyframe_selector(std::move(stages.keyframe_selector)),
        on_frame(std::move(observer.on_frame)),
        builder({std::move(stages.depth_estimator), std::move(stages.create_surfel_map),
                 std::move(observer.on_depth_map), surfel_export}) {}

  void Process(const Frame& frame);
  bool FeedBack();
  void TakePoses(const Frame& frame, const TrackingResult& tracking);
  void Change(const std::vector<KeyframeCorrection>& corrections);
  void Select(const Keyframe& keyframe);
  void TakeLast();
  void EndThread();
  PipelineCounts AllCounts(const ModelProgress& model) const;
  MapReconstruction OfMap(int map_id, const std::vector<TrajectoryEntry>& trajectory,
                          const std::vector<TrajectoryEntry>& keyframes);
};

void Pipeline::State::TakePoses(const Frame& frame, const TrackingResult& tracking) {
  if (tracking.T_world_cam) {
    ++counts.num_tracked;
    online_trajectory.push_back(
        {frame.index, frame.timestamp_s, tracking.map_id, *tracking.T_world_cam});
  } else {
    ++counts.untracked_frames[ReasonClass(tracking.reason)];
  }
  counts.num_recovered += static_cast<std::int64_t>(tracking.recovered.size());
  online_trajectory.insert(online_trajectory.end(), tracking.recovered.begin(),
                           tracking.recovered.end());
}

// A loop was closed or two maps were joined: what waits in the selector and what is in the model
// moves with its keyframes.
void Pipeline::State::Change(const std::vector<KeyframeCorrection>& corrections) {
  if (corrections.empty()) return;
  MapChange change = {joins.Take(corrections), corrections};
  for (const JoinedMap& joined : change.joined) MoveEntries(joined, online_trajectory);
  if (has_thrown) {
    if (!thread) builder.JoinFinished(change.joined);
    return;
  }
  ++counts.num_corrections;
  keyframe_selector->Correct(corrections);
  if (thread) {
    thread->Change(std::move(change));
  } else {
    builder.Change(change);
  }
}

// What the model says since the last call: to the tracker, where its keyframes are, and to the
// selector, what its bundles were worth. True where the tracker was told something.
bool Pipeline::State::FeedBack() {
  const ModelFeedback feedback = thread ? thread->TakeFeedback() : builder.TakeFeedback();
  for (const DepthQuality& worth : feedback.worths) keyframe_selector->ReportDepthQuality(worth);
  if (feedback.constraints.empty()) return false;
  tracker->Constrain(feedback.constraints);
  return true;
}

void Pipeline::State::Select(const Keyframe& keyframe) {
  ++counts.num_keyframes;
  joins.Remember(keyframe);
  std::optional<ImageBundle> bundle = keyframe_selector->Add(keyframe);
  if (!bundle) return;
  ++counts.num_bundles;
  if (thread) {
    thread->Add(*std::move(bundle));
  } else {
    builder.Add(*bundle);
  }
}

void Pipeline::State::Process(const Frame& frame) {
  ++counts.num_frames;
  (void)FeedBack();
  const TrackingResult tracking = tracker->Track(frame);
  TakePoses(frame, tracking);
  try {
    Change(tracking.corrections);
    for (const Keyframe& keyframe : tracking.finalised_keyframes) Select(keyframe);
  } catch (...) {
    has_thrown = true;
    throw;
  }
  if (!on_frame) return;
  const ModelProgress model = thread ? thread->Progress() : builder.Progress();
  const PipelineCounts all = AllCounts(model);
  on_frame({all, tracking, model.num_surfels, model.health});
}

// What is still on its way. No frame waits behind it, so that no bundle has to be dropped.
void Pipeline::State::TakeLast() {
  const auto wait = [&] {
    if (thread) thread->Wait();
  };
  if (!has_thrown) wait();
  if (has_thrown) EndThread();
  (void)FeedBack();
  Change(tracker->WaitForMapping());
  const std::vector<Keyframe> last_keyframes = tracker->Finish();
  if (!has_thrown) {
    for (const Keyframe& keyframe : last_keyframes) {
      wait();
      Select(keyframe);
    }
    wait();
    if (FeedBack()) Change(tracker->WaitForMapping());
    wait();
  }
  EndThread();
  builder.Close();
}

// Its count outlives it.
void Pipeline::State::EndThread() {
  if (thread) counts.num_dropped_bundles = thread->num_dropped();
  thread.reset();
}

PipelineCounts Pipeline::State::AllCounts(const ModelProgress& model) const {
  PipelineCounts all = counts;
  all.num_keyframes_without_image = tracker->num_keyframes_without_image();
  AddModelCounts(model.counts, all);
  if (thread) all.num_dropped_bundles = thread->num_dropped();
  return all;
}

MapReconstruction Pipeline::State::OfMap(int map_id, const std::vector<TrajectoryEntry>& trajectory,
                                         const std::vector<TrajectoryEntry>& keyframes) {
  ModelBuilder::OfMap& made = builder.Of(map_id);
  return {map_id,
          mono3d::OfMap(trajectory, map_id),
          mono3d::OfMap(online_trajectory, map_id),
          mono3d::OfMap(keyframes, map_id),
          mono3d::OfMap(builder.trajectory(), map_id),
          std::move(made.model),
          tracker->Sparse(map_id),
          std::move(made.fusions),
          made.health,
          std::move(made.health_changes),
          std::move(made.submap_joins)};
}

Pipeline::Pipeline(PipelineStages stages, PipelineObserver observer,
                   const SurfelExportOptions& surfel_export, PipelineMode mode)
    : state_(std::make_unique<State>(std::move(stages), std::move(observer), surfel_export)) {
  if (mode == PipelineMode::kLive) state_->thread = std::make_unique<ModelThread>(state_->builder);
}

Pipeline::~Pipeline() = default;

void Pipeline::Process(const Frame& frame) {
  NamingOutOfMemory("frame " + std::to_string(frame.index), [&] { state_->Process(frame); });
}

Reconstruction Pipeline::Finish() {
  State& state = *state_;
  try {
    NamingOutOfMemory("end of the run", [&] { state.TakeLast(); });
  } catch (...) {
    state.has_thrown = true;
    throw;
  }
  const std::vector<TrajectoryEntry> trajectory = state.tracker->Trajectory();
  const std::vector<TrajectoryEntry> keyframes = state.tracker->KeyframeTrajectory();
  std::map<int, std::int64_t> num_frames_of_map;
  for (const TrajectoryEntry& entry : trajectory) ++num_frames_of_map[entry.map_id];
  std::stable_sort(state.online_trajectory.begin(), state.online_trajectory.end(),
                   [](const TrajectoryEntry& a, const TrajectoryEntry& b) {
                     return a.frame_index < b.frame_index;
                   });
  Reconstruction result;
  for (const auto& [map_id, num_frames] : num_frames_of_map) {
    result.maps.push_back(state.OfMap(map_id, trajectory, keyframes));
  }
  std::stable_sort(result.maps.begin(), result.maps.end(),
                   [](const MapReconstruction& a, const MapReconstruction& b) {
                     return a.trajectory.size() > b.trajectory.size();
                   });
  result.counts = state.AllCounts(state.builder.Progress());
  return result;
}

const Tracker& Pipeline::tracker() const { return *state_->tracker; }

Reconstruction Pipeline::Run(FrameSource& source, const std::atomic<bool>* stop) {
  while (stop == nullptr || !stop->load()) {
    const std::optional<Frame> frame = source.Next();
    if (!frame) break;
    Process(*frame);
  }
  return Finish();
}

}  // namespace mono3d
