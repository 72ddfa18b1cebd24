// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "mono3d/image/sparse_model.h"
#include "mono3d/tracking/tracker.h"
#include "tracking/map/frame_record.h"
#include "tracking/map/map.h"
#include "tracking/map/published_poses.h"
#include "tracking/places/map_joining.h"
#include "tracking/places/place_index.h"
#include "tracking/priority_mutex.h"

namespace mono3d::tracking {

// All maps of a tracker, each with the index of its places, and the frames that were tracked in
// them. Keyframes have ids over all maps. One map is in use at a time, or none. Where a thread of
// its own maps, whoever calls has the map locked, but for Poses().
class Atlas {
 public:
  explicit Atlas(const FeatureOptions& features) : features_(features) {}

  std::size_t num_maps() const { return maps_.size(); }
  Map& map(std::size_t index) { return *maps_[index]; }
  const Map& map(std::size_t index) const { return *maps_[index]; }
  PlaceIndex& places(std::size_t index) { return places_[index]; }

  // A new map without keyframes, in use from now on. Until EndStart its keyframes have no ids.
  void StartMap(const CameraModel& camera);
  // Takes a map into use; its newest keyframe is the last one that was not culled.
  void Use(std::size_t index);
  void Leave() { is_in_use_ = false; }
  bool IsInUse() const { return is_in_use_; }
  // The map in use, or the last one that was.
  std::size_t current() const { return current_; }
  // The map in use has keyframes of other footage: it was loaded.
  bool HasLoadedKeyframes() const { return current_ == 0 && num_loaded_keyframes_ > 0; }
  Map& map() { return *maps_[current_]; }
  const Map& map() const { return *maps_[current_]; }
  PlaceIndex& places() { return places_[current_]; }

  // All of these are of the map in use.
  // The keyframe that was added last, unless SetNewest says otherwise.
  KeyframeId newest() const { return newest_; }
  void SetNewest(KeyframeId keyframe) { newest_ = keyframe; }
  KeyframeId AddKeyframe(const View& view);
  // Ends the start: its keyframes get their ids, in the order of flight.
  void EndStart();
  void AddPlace(KeyframeId keyframe);
  // Stores the pose of a tracked frame relative to the keyframe, or to the next older one where
  // that is culled. Returns the frame's number.
  std::size_t AddFrame(const View& view, KeyframeId keyframe);
  void RemoveFramesFrom(std::size_t index);
  // The number of the first frame of the map in use whose index is not below.
  std::size_t FirstFrameFrom(std::int64_t frame_index) const;
  // The keyframe that the frame became, unless that is culled.
  std::optional<KeyframeId> KeyframeOf(std::size_t frame) const;
  // A frame that was added turned out to be elsewhere; its keyframe stays.
  void MoveFrame(std::size_t index, const View& view);
  // The frames that have been moved since the last call, each once.
  std::vector<FramePose> TakeMoved();

  std::size_t num_frames() const { return frames_.size(); }
  std::size_t map_of_frame(std::size_t frame) const {
    return static_cast<std::size_t>(frames_[frame].map_id);
  }
  KeyframeId keyframe_of_frame(std::size_t frame) const { return frames_[frame].keyframe; }
  // The frame's pose by the present pose of its keyframe.
  Pose T_cam_world(std::size_t frame) const { return PoseOf(frames_[frame], MapOf(frame)); }
  FramePose frame_pose(std::size_t frame) const {
    return ToFramePose(frames_[frame], MapOf(frame));
  }
  // In the order in which they were tracked.
  std::vector<FramePose> FramePosesFrom(std::size_t first_frame) const;

  // Joins the map in use to another one that shares a place with it; that one is in use from then
  // on, because others may rely on its world already. Returns what was added to the numbers of the
  // keyframes and points of the map in use.
  NumberShift JoinInto(std::size_t other, const PlaceFound& place,
                       const LocalMappingOptions& options, MappingLock& lock);

  // Takes a snapshot of where all keyframes are.
  void PublishPoses() { poses_.Publish(maps_); }
  // The last one. From any thread.
  KeyframePosesPtr Poses() const { return poses_.Latest(); }

  // See Tracker.
  std::vector<TrajectoryEntry> Trajectory() const { return ToTrajectory(frames_, maps_); }
  std::vector<TrajectoryEntry> KeyframeTrajectory() const;
  SparseModel Sparse(int map_id) const;
  std::string Save() const;
  // The map is one of the atlas from then on, but not in use.
  void Load(std::string_view bytes, const std::string& where);
  // To be called with the first frame: where it does not continue the footage of a loaded map, the
  // frames of that map are left out of the trajectory, because times and indices would mix.
  void BeginFootage(const Frame& first);
  // Between two frames, for the archives of image/state_archive.h.
  template <typename Archive>
  void ExchangeState(Archive& archive);

 private:
  const Map& MapOf(std::size_t frame) const {
    return *maps_[static_cast<std::size_t>(frames_[frame].map_id)];
  }

  bool IsConsistent() const;

  FeatureOptions features_;
  std::vector<std::unique_ptr<Map>> maps_;  // by their ids
  std::vector<PlaceIndex> places_;          // of each map
  std::size_t current_ = 0;
  bool is_in_use_ = false;
  bool is_starting_ = false;
  KeyframeId newest_ = 0;
  std::vector<FrameRecord> frames_;
  std::set<std::size_t> moved_;
  std::int64_t next_keyframe_id_ = 0;
  bool is_loaded_ = false;                // and no frame has come since
  std::size_t num_loaded_keyframes_ = 0;  // of map 0, of other footage
  PublishedPoses poses_;
};

}  // namespace mono3d::tracking
