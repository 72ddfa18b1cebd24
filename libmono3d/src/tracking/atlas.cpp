// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/atlas.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "image/state_archive.h"
#include "mono3d/core/error.h"
#include "tracking/map/map_bytes.h"
#include "tracking/map/map_checks.h"
#include "tracking/map/map_state.h"
#include "tracking/map/sparse_export.h"

namespace mono3d::tracking {

void Atlas::StartMap(const CameraModel& camera) {
  current_ = maps_.size();
  maps_.push_back(std::make_unique<Map>(static_cast<int>(current_), camera, features_));
  places_.emplace_back();
  is_in_use_ = true;
  is_starting_ = true;
  newest_ = 0;
}

void Atlas::Use(std::size_t index) {
  current_ = index;
  is_in_use_ = true;
  newest_ = map().keyframes().size() - 1;
  while (!map().keyframe(newest_).alive) --newest_;
}

KeyframeId Atlas::AddKeyframe(const View& view) {
  newest_ = map().AddKeyframe(view);
  if (!is_starting_) map().keyframe(newest_).id = next_keyframe_id_++;
  return newest_;
}

void Atlas::EndStart() {
  for (const KeyframeId id : map().InOrderOfFlight()) map().keyframe(id).id = next_keyframe_id_++;
  is_starting_ = false;
}

void Atlas::AddPlace(KeyframeId keyframe) {
  places().Add(keyframe, FeaturesWithPoints(map().keyframe(keyframe).view));
}

std::size_t Atlas::AddFrame(const View& view, KeyframeId keyframe) {
  while (!map().keyframe(keyframe).alive) --keyframe;
  frames_.push_back(MakeRecord(view, map(), keyframe));
  return frames_.size() - 1;
}

std::optional<KeyframeId> Atlas::KeyframeOf(std::size_t frame) const {
  const FrameRecord& record = frames_[frame];
  const MapKeyframe& keyframe = MapOf(frame).keyframe(record.keyframe);
  const bool is_it = keyframe.alive && keyframe.view.frame.index == record.frame_index;
  return is_it ? std::optional<KeyframeId>(record.keyframe) : std::nullopt;
}

void Atlas::MoveFrame(std::size_t index, const View& view) {
  frames_[index] = MakeRecord(view, map(), frames_[index].keyframe);
  moved_.insert(index);
}

std::vector<FramePose> Atlas::TakeMoved() {
  std::vector<FramePose> poses;
  for (const std::size_t index : moved_) poses.push_back(frame_pose(index));
  moved_.clear();
  return poses;
}

void Atlas::RemoveFramesFrom(std::size_t index) {
  frames_.resize(index);
  moved_.erase(moved_.lower_bound(index), moved_.end());
}

std::size_t Atlas::FirstFrameFrom(std::int64_t frame_index) const {
  const auto first = std::find_if(frames_.begin(), frames_.end(), [&](const FrameRecord& frame) {
    return frame.map_id == map().id() && frame.frame_index >= frame_index;
  });
  return static_cast<std::size_t>(first - frames_.begin());
}

std::vector<FramePose> Atlas::FramePosesFrom(std::size_t first_frame) const {
  std::vector<FramePose> poses;
  for (std::size_t i = first_frame; i < frames_.size(); ++i) poses.push_back(frame_pose(i));
  return poses;
}

NumberShift Atlas::JoinInto(std::size_t other, const PlaceFound& place,
                            const LocalMappingOptions& options, MappingLock& lock) {
  const NumberShift shift = JoinMaps(*maps_[other], places_[other], map(), place, options, lock);
  for (FrameRecord& frame : frames_) {
    if (frame.map_id != map().id()) continue;
    frame.map_id = maps_[other]->id();
    frame.keyframe += shift.keyframes;
  }
  places() = PlaceIndex();
  current_ = other;
  newest_ += shift.keyframes;
  return shift;
}

std::vector<TrajectoryEntry> Atlas::KeyframeTrajectory() const {
  std::vector<TrajectoryEntry> entries;
  for (const std::unique_ptr<Map>& of : maps_) {
    for (const KeyframeId id : of->InOrderOfFlight()) {
      if (of->id() == 0 && id < num_loaded_keyframes_) continue;
      const Frame& frame = of->keyframe(id).view.frame;
      entries.push_back({frame.index, frame.timestamp_s, of->id(), of->T_cam_world(id).Inverse()});
    }
  }
  return entries;
}

SparseModel Atlas::Sparse(int map_id) const {
  if (map_id < 0 || static_cast<std::size_t>(map_id) >= maps_.size()) return {};
  const Map& of = *maps_[static_cast<std::size_t>(map_id)];
  SparseModel model = ToSparseModel(of);
  NumberByFrames(of, model);
  return model;
}

std::string Atlas::Save() const {
  if (maps_.empty()) throw Error("there is no map to save: tracking has not started");
  std::vector<std::vector<FrameRecord>> frames(maps_.size());
  for (const FrameRecord& frame : frames_) {
    frames[static_cast<std::size_t>(frame.map_id)].push_back(frame);
  }
  const auto most =
      std::max_element(frames.begin(), frames.end(),
                       [](const auto& a, const auto& b) { return a.size() < b.size(); });
  return ToBytes(*maps_[static_cast<std::size_t>(most - frames.begin())], features_, *most);
}

void Atlas::Load(std::string_view bytes, const std::string& where) {
  SavedMap saved = FromBytes(bytes, where);
  if (saved.features.num_levels != features_.num_levels ||
      saved.features.scale_factor != features_.scale_factor) {
    throw UsageError(ErrorParts{.what = "saved map has other pyramid levels than tracking.features",
                                .where = where,
                                .expected = std::to_string(features_.num_levels) + " levels by " +
                                            std::to_string(features_.scale_factor),
                                .found = std::to_string(saved.features.num_levels) + " levels by " +
                                         std::to_string(saved.features.scale_factor)});
  }
  const std::size_t index = maps_.size();
  maps_.push_back(std::move(saved.map));
  places_.emplace_back();
  frames_ = std::move(saved.frames);
  Use(index);
  Leave();
  num_loaded_keyframes_ = map().keyframes().size();
  is_loaded_ = true;
  for (KeyframeId id = 0; id < map().keyframes().size(); ++id) {
    next_keyframe_id_ = std::max(next_keyframe_id_, map().keyframe(id).id + 1);
    if (map().keyframe(id).alive) AddPlace(id);
  }
  PublishPoses();
}

void Atlas::BeginFootage(const Frame& first) {
  if (!is_loaded_) return;
  is_loaded_ = false;
  const bool goes_on = std::all_of(frames_.begin(), frames_.end(), [&](const FrameRecord& frame) {
    return frame.frame_index < first.index && frame.timestamp_s < first.timestamp_s;
  });
  if (goes_on) {
    num_loaded_keyframes_ = 0;
  } else {
    frames_.clear();
  }
}

template <typename Archive>
void Atlas::ExchangeState(Archive& archive) {
  std::uint64_t num_maps = maps_.size();
  archive.Number(num_maps);
  for (std::uint64_t i = 0; i < num_maps; ++i) {
    CameraModel camera;
    if constexpr (!Archive::kReads) camera = maps_[i]->camera();
    mono3d::ExchangeState(archive, camera);
    if constexpr (Archive::kReads) {
      Validate(camera, "saved map " + std::to_string(i));
      maps_.push_back(std::make_unique<Map>(static_cast<int>(i), camera, features_));
      places_.emplace_back();
    }
    maps_[i]->ExchangeState(archive);
    places_[i].ExchangeState(archive, maps_[i]->keyframes().size());
  }
  archive.Index(current_);
  archive.Number(is_in_use_);
  archive.Index(newest_);
  // Most of them never change any more.
  constexpr std::size_t kFramesOfSection = 64;
  archive.Sections(frames_, kFramesOfSection,
                   [&](FrameRecord& frame) { tracking::ExchangeState(archive, frame); });
  std::vector<std::size_t> moved(moved_.begin(), moved_.end());
  archive.List(moved, [&](std::size_t& frame) { archive.Index(frame); });
  moved_ = {moved.begin(), moved.end()};
  archive.Number(next_keyframe_id_);
  archive.Number(is_loaded_);
  archive.Index(num_loaded_keyframes_);
  poses_.ExchangeState(archive);
  if constexpr (Archive::kReads) {
    if (!IsConsistent()) archive.Refuse("contradicts itself");
  }
}

template void Atlas::ExchangeState(StateWriter&);
template void Atlas::ExchangeState(StateReader&);

bool Atlas::IsConsistent() const {
  constexpr std::int64_t kMaxId = std::int64_t{1} << 53;
  std::set<std::int64_t> ids;  // of keyframes, over all maps
  for (const std::unique_ptr<Map>& of : maps_) {
    for (const MapKeyframe& keyframe : of->keyframes()) {
      if (keyframe.id >= next_keyframe_id_ || !ids.insert(keyframe.id).second) return false;
    }
  }
  const bool is_current = maps_.empty() ? current_ == 0 && !is_in_use_ : current_ < maps_.size();
  if (!is_current || next_keyframe_id_ < 0 || next_keyframe_id_ > kMaxId) return false;
  if (is_in_use_ && (newest_ >= map().keyframes().size() || !map().keyframe(newest_).alive)) {
    return false;
  }
  return std::ranges::all_of(
             frames_,
             [&](const FrameRecord& frame) {
               return frame.map_id >= 0 && static_cast<std::size_t>(frame.map_id) < maps_.size() &&
                      IsKeyframeOf(*maps_[static_cast<std::size_t>(frame.map_id)], frame.keyframe);
             }) &&
         (moved_.empty() || *moved_.rbegin() < frames_.size());
}

}  // namespace mono3d::tracking
