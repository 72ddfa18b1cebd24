// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/chain.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <utility>

#include "image/state_archive.h"
#include "mono3d/image/global_shutter.h"
#include "pipeline/map_joins.h"
#include "pipeline/model_counts.h"
#include "pipeline/run_state.h"
#include "pipeline/state_parts.h"
#include "pipeline/trailing_model_worker.h"

namespace mono3d {
namespace {

constexpr const char* kChainState = "state of the run";
constexpr std::uint32_t kChainStateVersion = 1;
constexpr const char* kChainPart = "chain";
constexpr const char* kTrackerPart = "tracker";
constexpr const char* kSelectorPart = "keyframe_selector";
// Poses of frames seldom change: they are written once, so many in one piece.
constexpr std::size_t kEntriesPerSection = 1024;

std::vector<TrajectoryEntry> EntriesOfMap(const std::vector<TrajectoryEntry>& entries, int map_id) {
  std::vector<TrajectoryEntry> selected;
  std::copy_if(entries.begin(), entries.end(), std::back_inserter(selected),
               [&](const TrajectoryEntry& entry) { return entry.map_id == map_id; });
  return selected;
}

void SortByFrame(std::vector<TrajectoryEntry>& entries) {
  std::ranges::stable_sort(entries, {}, &TrajectoryEntry::frame_index);
}

std::vector<TrajectoryEntry> EntriesInWorld(const std::vector<FramePose>& frames,
                                            const KeyframePoses& poses) {
  std::vector<TrajectoryEntry> entries;
  for (const FramePose& frame : frames) {
    if (const auto entry = InWorld(frame, poses)) entries.push_back(*entry);
  }
  SortByFrame(entries);
  return entries;
}

}  // namespace

Chain::Chain(std::unique_ptr<Tracker> tracker, std::unique_ptr<KeyframeSelector> keyframe_selector,
             std::unique_ptr<ModelWorker> worker, std::function<void(const Keyframe&)> on_keyframe,
             const PipelineOptions& options)
    : tracker_(std::move(tracker)),
      keyframe_selector_(std::move(keyframe_selector)),
      worker_(std::move(worker)),
      on_keyframe_(std::move(on_keyframe)),
      is_live_(options.is_live),
      stop_(options.are_photos ? options.photos.stop : nullptr) {
  if (options.positions) positions_.emplace(*options.positions, is_live_);
}

TrackingResult Chain::Process(const Frame& frame) {
  ++counts_.num_frames;
  (void)FeedBack();
  TrackingResult tracking = tracker_->Track(frame);
  TakePoses(frame, tracking);
  try {
    Update();
    FollowPositions(tracking);
    for (const Keyframe& keyframe : tracking.finalised_keyframes) Select(keyframe);
  } catch (...) {
    has_thrown_ = true;
    throw;
  }
  Publish(frame, tracking);
  return tracking;
}

// Of what is done so far, for State.
void Chain::TakeCounts() {
  PipelineCounts counts = counts_;
  counts.num_keyframes_without_image = tracker_->num_keyframes_without_image();
  const std::lock_guard lock(mutex_);
  latest_.snapshot.counts = std::move(counts);
}

void Chain::Publish(const Frame& frame, const TrackingResult& tracking) {
  TakeCounts();
  const std::lock_guard lock(mutex_);
  PipelineSnapshot& snapshot = latest_.snapshot;
  snapshot.frame_index = frame.index;
  snapshot.timestamp_s = frame.timestamp_s;
  snapshot.status = tracking.status;
  snapshot.loss = tracking.loss;
  snapshot.reason = tracking.reason;
  latest_.pose = tracking.pose;
}

// In this order, so that no model is made of bundles that are not counted yet, and the latest frame
// has its keyframe among the poses.
PipelineSnapshot Chain::State() const {
  const ModelProgress progress = worker_->Progress();
  Latest latest;
  {
    const std::lock_guard lock(mutex_);
    latest = latest_;
  }
  PipelineSnapshot& snapshot = latest.snapshot;
  snapshot.keyframe_poses = tracker_->Poses();
  if (latest.pose) snapshot.pose = InWorld(*latest.pose, *snapshot.keyframe_poses);
  AddModelCounts(progress.counts, snapshot.counts);
  snapshot.num_surfels = progress.num_surfels;
  snapshot.health = progress.health;
  if (positions_) snapshot.place = positions_->place();
  return snapshot;
}

PipelineSnapshot Chain::Snapshot(std::uint64_t since_version) const {
  PipelineSnapshot snapshot = State();
  PublishedModel published = worker_->Published(since_version);
  snapshot.surfels = std::move(published.surfels);
  snapshot.model_map_id = published.map_id;
  snapshot.model_poses = std::move(published.poses);
  return snapshot;
}

// Tells the tracker where its keyframes are in the model, and the selector how good depth maps are,
// since the last call. True where the tracker was told something.
bool Chain::FeedBack() {
  const ModelFeedback feedback = worker_->TakeFeedback();
  for (const DepthQuality& quality : feedback.qualities) {
    keyframe_selector_->ReportDepthQuality(quality);
  }
  if (feedback.constraints.empty()) return false;
  tracker_->Constrain(feedback.constraints);
  return true;
}

std::size_t Chain::NumKeyframesOf(int map_id) const {
  return static_cast<std::size_t>(
      std::ranges::count(poses_->poses(), map_id, &KeyframePose::map_id));
}

void Chain::GivePositions(PositionTrack track) {
  if (!positions_) throw UsageError("GivePositions without PipelineOptions::positions");
  positions_->SetTrack(std::move(track));
}

// The tracker follows them with its next keyframe.
void Chain::FollowPositions(const TrackingResult& tracking) {
  if (!positions_ || !tracking.is_keyframe) return;
  positions_->Give(tracking.map_id, NumKeyframesOf(tracking.map_id), *tracker_);
}

// Twice: how the clocks lie to each other is known better once the path has moved.
void Chain::FollowAllPositions() {
  if (!positions_) return;
  constexpr int kTimes = 2;
  for (int i = 0; i < kTimes; ++i) {
    std::set<int> map_ids;
    for (const TrajectoryEntry& entry : tracker_->KeyframeTrajectory()) {
      map_ids.insert(entry.map_id);
    }
    for (const int map_id : map_ids) positions_->GiveNow(map_id, NumKeyframesOf(map_id), *tracker_);
    tracker_->WaitForMapping();
  }
}

template <typename Archive>
void Chain::ExchangeState(Archive& archive) {
  using mono3d::ExchangeState;
  ExchangeState(archive, counts_);
  archive.Number(has_changed_images_);
  ExchangeState(archive, poses_);
  if (positions_) positions_->ExchangeState(archive);
  archive.Sections(online_trajectory_, kEntriesPerSection,
                   [&](TrajectoryEntry& entry) { ExchangeState(archive, entry); });
}

void Chain::SaveState(StateFolder& folder, const std::function<void()>& at_rest) {
  if (is_live_) throw UsageError("the state of a live run cannot be saved");
  if (has_thrown_) throw UsageError("a run that has failed has no state to go on from");
  StateWriter writer(kChainState, kChainStateVersion, SavedImages::kByIndex);
  ExchangeState(writer);
  PutSections(folder, kChainPart, writer.TakeState());
  PutSections(folder, kTrackerPart, tracker_->SaveState(SavedImages::kByIndex));
  const SavedImages of_keyframes =
      has_changed_images_ ? SavedImages::kIncluded : SavedImages::kByIndex;
  PutSections(folder, kSelectorPart, keyframe_selector_->SaveState(of_keyframes));
  worker_->SaveState(folder, of_keyframes, at_rest);
}

std::vector<std::int64_t> Chain::FramesOfState(const StateFolder& folder) {
  const std::string where = folder.path().string();
  std::vector<std::int64_t> frames =
      mono3d::FramesOfState(GetSections(folder, kTrackerPart), where);
  const std::vector<std::int64_t> of_selector =
      mono3d::FramesOfState(GetSections(folder, kSelectorPart), where);
  frames.insert(frames.end(), of_selector.begin(), of_selector.end());
  const std::vector<std::int64_t> of_models = TrailingModelWorker::FramesOfState(folder);
  frames.insert(frames.end(), of_models.begin(), of_models.end());
  return frames;
}

void Chain::RestoreState(const StateFolder& folder, const ImageOfFrame& images) {
  const std::string where = folder.path().string();
  const std::string state = GetSections(folder, kChainPart);
  StateReader reader(state, kChainState, kChainStateVersion, where, images);
  ExchangeState(reader);
  reader.CheckEnd();
  tracker_->RestoreState(GetSections(folder, kTrackerPart), where, images);
  keyframe_selector_->RestoreState(GetSections(folder, kSelectorPart), where, images);
  // The same object where it is the same snapshot: else all would follow it once more.
  const KeyframePosesPtr latest = tracker_->Poses();
  if (latest->version() == poses_->version()) poses_ = latest;
  worker_->RestoreState(folder, poses_, images);
  TakeCounts();
}

void Chain::TakePoses(const Frame& frame, const TrackingResult& tracking) {
  if (tracking.is_pending) return;
  if (tracking.T_world_cam) {
    ++counts_.num_tracked;
    online_trajectory_.push_back(
        {frame.index, frame.timestamp_s, tracking.map_id, *tracking.T_world_cam});
  } else {
    CountReason(tracking.reason, 1, counts_.untracked_frames);
  }
  counts_.num_recovered += static_cast<std::int64_t>(tracking.recovered.size());
  if (tracking.recovered.empty()) return;
  const std::vector<TrajectoryEntry> recovered =
      EntriesInWorld(tracking.recovered, *tracker_->Poses());
  online_trajectory_.insert(online_trajectory_.end(), recovered.begin(), recovered.end());
}

// What became of the frames that were pending.
void Chain::TakeLateResults() {
  std::vector<FramePose> placed;
  for (const LateResult& late : tracker_->LateResults()) {
    if (late.pose) {
      placed.push_back(*late.pose);
    } else {
      CountReason(late.reason, 1, counts_.untracked_frames);
      unplaced_photos_[late.frame_index] = late.reason;
    }
  }
  counts_.num_recovered += static_cast<std::int64_t>(placed.size());
  const std::vector<TrajectoryEntry> entries = EntriesInWorld(placed, *tracker_->Poses());
  online_trajectory_.insert(online_trajectory_.end(), entries.begin(), entries.end());
}

// What follows keyframes goes where the tracker has them now.
void Chain::Update() {
  const KeyframePosesPtr poses = tracker_->Poses();
  if (poses == poses_) return;
  for (const MapJoin& join : FindMapJoins(*poses_, *poses)) MoveEntries(join, online_trajectory_);
  poses_ = poses;
  if (!has_thrown_) worker_->Update(poses);
}

// The tracker has used the image as it was taken; from here on all its lines are of one time.
void Chain::Select(const Keyframe& from_tracker) {
  ++counts_.num_keyframes;
  const Keyframe keyframe = WithGlobalShutter(from_tracker);
  has_changed_images_ |= keyframe.frame.bgr.data != from_tracker.frame.bgr.data;
  if (on_keyframe_) on_keyframe_(keyframe);
  std::optional<ImageBundle> bundle = keyframe_selector_->Add(keyframe, *poses_);
  counts_.selector_findings = keyframe_selector_->Findings();
  if (bundle) AddBundle(*std::move(bundle));
}

void Chain::AddBundle(ImageBundle bundle) {
  ++counts_.num_bundles;
  TakeCounts();
  worker_->Add(std::move(bundle), poses_);
}

bool Chain::IsStopped() const { return stop_ != nullptr && *stop_; }

// What is still on its way. No frame waits behind it, so that no bundle has to be dropped.
void Chain::ProcessLast() {
  if (has_thrown_) {
    (void)worker_->End();
  } else {
    worker_->Wait();
  }
  (void)FeedBack();
  tracker_->WaitForMapping();
  FollowAllPositions();
  const std::vector<Keyframe> last_keyframes = tracker_->Finish();
  TakeLateResults();
  Update();
  if (!has_thrown_) {
    for (const Keyframe& keyframe : last_keyframes) {
      if (IsStopped()) break;
      worker_->WaitForRoom();
      Select(keyframe);
    }
    worker_->Wait();
    const bool has_constraints = FeedBack();
    for (ImageBundle& bundle : keyframe_selector_->Finish(*poses_)) {
      if (IsStopped()) break;
      worker_->WaitForRoom();
      AddBundle(std::move(bundle));
    }
    counts_.selector_findings = keyframe_selector_->Findings();
    worker_->Wait();
    if (FeedBack() || has_constraints) {
      tracker_->WaitForMapping();
      Update();
    }
    worker_->Wait();
  }
  worker_->End().Close(poses_);
}

Reconstruction Chain::Finish() {
  try {
    ProcessLast();
  } catch (...) {
    has_thrown_ = true;
    throw;
  }
  const std::vector<TrajectoryEntry> trajectory = tracker_->Trajectory();
  const std::vector<TrajectoryEntry> keyframes = tracker_->KeyframeTrajectory();
  SortByFrame(online_trajectory_);
  std::map<int, std::int64_t> num_frames_of_map;
  for (const TrajectoryEntry& entry : trajectory) ++num_frames_of_map[entry.map_id];
  Reconstruction result;
  ModelBuilder& builder = worker_->End();
  for (const auto& [map_id, num_frames] : num_frames_of_map) {
    result.maps.push_back(OfMap(map_id, builder.Of(map_id), trajectory, keyframes));
  }
  std::stable_sort(result.maps.begin(), result.maps.end(),
                   [](const MapReconstruction& a, const MapReconstruction& b) {
                     return a.trajectory.size() > b.trajectory.size();
                   });
  for (const PositionFit& fit : tracker_->PositionFits()) {
    for (MapReconstruction& map : result.maps) {
      if (map.map_id == fit.map_id) map.position_fit = fit;
    }
  }
  TakeCounts();
  result.counts = latest_.snapshot.counts;
  result.unplaced_photos = std::move(unplaced_photos_);
  AddModelCounts(worker_->Progress().counts, result.counts);
  return result;
}

MapReconstruction Chain::OfMap(int map_id, ModelBuilder::OfMap& made,
                               const std::vector<TrajectoryEntry>& trajectory,
                               const std::vector<TrajectoryEntry>& keyframes) const {
  return {map_id,
          EntriesOfMap(trajectory, map_id),
          EntriesOfMap(online_trajectory_, map_id),
          EntriesOfMap(keyframes, map_id),
          EntriesInWorld(made.depth_maps, *poses_),
          std::move(made.model),
          tracker_->Sparse(map_id),
          std::move(made.fusions),
          made.health,
          std::move(made.health_changes),
          std::move(made.submap_joins)};
}

}  // namespace mono3d
