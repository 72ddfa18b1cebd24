// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reconstruct/interim_results.h"

#include <chrono>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/state_json.h"
#include "common/tool.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/core/timing.h"
#include "mono3d/pipeline/georeferencing.h"

namespace mono3d::tools {
namespace {

// So much of a run is lost at most when it is killed: of the video, or of the run where that is
// slower.
constexpr double kInterval_s = 5;
constexpr double kMaxWallInterval_s = 20;
// A large model takes long to write: no more than a twentieth of the time.
constexpr double kMaxShareOfTime = 0.05;
// Some hundred megabytes.
constexpr std::int64_t kMaxSurfelsBesideJournal = 3'000'000;
constexpr auto kPollInterval = std::chrono::milliseconds(250);

double InterimClock_s() { return 1e-3 * WallClockMs(); }

int MapWithMostFrames(const std::vector<TrajectoryEntry>& entries) {
  std::map<int, int> num_frames;
  int best = 0;
  for (const TrajectoryEntry& entry : entries) ++num_frames[entry.map_id];
  for (const auto& [map_id, count] : num_frames) {
    if (count > num_frames[best]) best = map_id;
  }
  return best;
}

}  // namespace

void FramesSoFar::Take(const PipelineProgress& progress) {
  const std::lock_guard lock(mutex_);
  const TrackingResult& tracking = progress.tracking;
  if (tracking.pose) {
    latest_s_ = tracking.pose->timestamp_s;
    Keep(*tracking.pose);
  }
  for (const FramePose& frame : tracking.recovered) Keep(frame);
  for (const FramePose& frame : tracking.refined) Keep(frame);
}

void FramesSoFar::Take(const Keyframe& keyframe) {
  const std::lock_guard lock(mutex_);
  stamps_[keyframe.id] = {keyframe.frame.index, keyframe.frame.timestamp_s, 0, Pose()};
}

void FramesSoFar::Forget() {
  const std::lock_guard lock(mutex_);
  frames_.clear();
  stamps_.clear();
}

double FramesSoFar::latest_s() const {
  const std::lock_guard lock(mutex_);
  return latest_s_;
}

MapReconstruction FramesSoFar::InMap(const PipelineSnapshot& snapshot) const {
  MapReconstruction map;
  std::vector<TrajectoryEntry> entries;
  const std::lock_guard lock(mutex_);
  for (const auto& [index, frame] : frames_) {
    if (const auto entry = InWorld(frame, *snapshot.keyframe_poses)) entries.push_back(*entry);
  }
  map.map_id = snapshot.model_poses ? snapshot.model_map_id : MapWithMostFrames(entries);
  for (const TrajectoryEntry& entry : entries) {
    if (entry.map_id == map.map_id) map.trajectory.push_back(entry);
  }
  for (const KeyframePose& keyframe : snapshot.keyframe_poses->poses()) {
    const auto stamp = stamps_.find(keyframe.keyframe_id);
    if (stamp == stamps_.end() || keyframe.map_id != map.map_id) continue;
    map.keyframes.push_back(
        {stamp->second.frame_index, stamp->second.timestamp_s, map.map_id, keyframe.T_world_cam()});
  }
  map.health = snapshot.health;
  return map;
}

nlohmann::json FramesSoFar::ToJson() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::uint8_t> frames;
  for (const auto& [index, frame] : frames_) {
    AddRow(frames, index, frame.timestamp_s, frame.keyframe_id, ToSaved(frame.T_kf_cam));
  }
  std::vector<std::uint8_t> stamps;
  for (const auto& [id, stamp] : stamps_) AddRow(stamps, id, stamp.frame_index, stamp.timestamp_s);
  return {{"latest_s", latest_s_},
          {"frames", nlohmann::json::binary(std::move(frames))},
          {"keyframes", nlohmann::json::binary(std::move(stamps))}};
}

void FramesSoFar::TakeJson(const nlohmann::json& json) {
  const std::lock_guard lock(mutex_);
  json.at("latest_s").get_to(latest_s_);
  frames_.clear();
  ForEachRow<std::int64_t, double, std::int64_t, SavedPose>(
      json.at("frames"), [&](std::int64_t index, double timestamp_s, std::int64_t keyframe_id,
                             const SavedPose& T_kf_cam) {
        Keep({index, timestamp_s, keyframe_id, FromSaved(T_kf_cam)});
      });
  stamps_.clear();
  ForEachRow<std::int64_t, std::int64_t, double>(
      json.at("keyframes"), [&](std::int64_t id, std::int64_t frame_index, double timestamp_s) {
        stamps_[id] = {frame_index, timestamp_s, 0, Pose()};
      });
}

InterimWriter::InterimWriter(const RunWriter& writer, const FramesSoFar& frames, RunRecord record,
                             TakeSnapshot snapshot, TakeSnapshot state)
    : writer_(writer),
      frames_(frames),
      record_(std::move(record)),
      snapshot_(std::move(snapshot)),
      state_(std::move(state)) {
  record_.end = RunEnd::kUnfinished;
  thread_ = std::thread([this] { Run(); });
}

InterimWriter::~InterimWriter() {
  try {
    End();
  } catch (...) {  // another error is on its way
  }
}

void InterimWriter::End() {
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

void InterimWriter::Run() {
  double written_s = frames_.latest_s();  // in time of the video
  double end_s = InterimClock_s();
  double duration_s = 0;
  std::unique_lock lock(mutex_);
  while (!changed_.wait_for(lock, kPollInterval, [&] { return is_ending_; })) {
    const double latest_s = frames_.latest_s();
    const double waited_s = InterimClock_s() - end_s;
    const bool is_due = latest_s >= written_s + kInterval_s ||
                        (latest_s > written_s && waited_s >= kMaxWallInterval_s);
    if (!is_due || waited_s < duration_s / kMaxShareOfTime) continue;
    written_s = latest_s;
    lock.unlock();
    const double start_s = InterimClock_s();
    try {
      Write();
    } catch (...) {
      error_ = std::current_exception();
      return;
    }
    end_s = InterimClock_s();
    duration_s = end_s - start_s;
    lock.lock();
  }
}

void InterimWriter::Write() {
  PipelineSnapshot snapshot;
  if (state_) snapshot = state_();
  const bool has_model = !state_ || snapshot.num_surfels <= kMaxSurfelsBesideJournal;
  if (has_model) snapshot = snapshot_();
  // What cannot be written now may be written next time; the end of the run says what could not.
  try {
    Reconstruction so_far;
    so_far.counts = snapshot.counts;
    MapReconstruction& map = so_far.maps.emplace_back(frames_.InMap(snapshot));
    if (map.trajectory.empty()) return;
    // A model that is not written again stays where it was, and all the rest with it.
    const std::shared_ptr<const PlaceOfMap> place = has_model ? snapshot.place : place_;
    if (snapshot.surfels.version != model_version_ || place != place_) {
      map.model = ToPointCloud(snapshot.surfels);
    }
    if (place && place->map_id == map.map_id) PlaceOnEarth(place->georeference, map);
    writer_.WriteInterim(map);
    model_version_ = snapshot.surfels.version;
    place_ = place;
    writer_.WriteRecord(so_far, record_);
  } catch (const std::exception& error) {
    if (!has_warned_) Log(LogLevel::kWarning, "results so far: " + WordsOf(error));
    has_warned_ = true;
  }
}

}  // namespace mono3d::tools
