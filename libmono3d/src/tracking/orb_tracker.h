// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "mono3d/tracking/tracker.h"
#include "tracking/backlog.h"
#include "tracking/map/frame_record.h"
#include "tracking/map/map.h"
#include "tracking/map/published_poses.h"
#include "tracking/mapping_thread.h"
#include "tracking/optimisation/view_pose.h"
#include "tracking/places/place_index.h"
#include "tracking/start/map_initialiser.h"

namespace mono3d::tracking {

// The tracker behind CreateTracker: the order in which the stages run, and what they remember from
// frame to frame.
class OrbTracker final : public Tracker {
 public:
  OrbTracker(const TrackerOptions& options, StageTimes* times);

  TrackingResult Track(const Frame& frame) override;
  KeyframePosesPtr Poses() const override { return poses_.Latest(); }
  void WaitForMapping() override;
  std::vector<Keyframe> Finish() override;
  std::vector<TrajectoryEntry> Trajectory() const override;
  std::vector<TrajectoryEntry> KeyframeTrajectory() const override;
  void Constrain(std::span<const KeyframeConstraint> constraints) override;
  PointCloud MapPoints(int map_id) const override;
  SparseModel Sparse(int map_id) const override;
  std::string SaveMap() const override;
  void LoadMap(std::string_view bytes, const std::string& where) override;

 private:
  View MakeView(const Frame& frame) const;
  void AddFeatures(View& view) const;
  bool SharesLittle(const View& view) const;
  TrackingResult Initialise(View view);
  std::vector<FramePose> StartMap(const MapStart& start);
  void TrackBacklog(const std::vector<Frame>& frames, bool may_insert);
  std::vector<FramePose> TrackLostFrames();
  TrackingResult Follow(View view);
  PoseResult FindPose(View& view);
  PoseResult FindPoseByFeatures(View& view);
  PoseResult RefineByPatchAlignment(View& view, const PoseResult& pose);
  TrackingResult Lose(const View& view, const std::string& reason);
  TrackingResult Continue(View view, const PoseResult& pose);
  PoseResult Recover(View& view);
  std::optional<TrackingResult> Return(View& view);
  enum class MapWhen { kNow, kWhenThereIsTime };
  bool InsertIfNeeded(View& view, const PoseResult& pose, MapWhen when);
  bool RecognisePlace(KeyframeId keyframe, MappingLock& lock);
  bool FollowModel(MappingLock& lock);
  void RescaleMotion(double ratio);
  bool CloseLoopIfAny(KeyframeId keyframe, MappingLock& lock);
  std::optional<KeyframeId> JoinIfKnown(KeyframeId keyframe, MappingLock& lock);
  void UpdateMotion(const View& view);
  void Remember(View view);
  std::vector<FramePose> RememberedSince(std::size_t first_record) const;
  void PublishPoses();
  void JoinLoadedFrames(const Frame& first);
  MappingWork BackgroundWork();
  std::unique_ptr<TrackingLock> Lock() const;
  void HandOver(TrackingResult& result);

  Map& map() { return *maps_[current_]; }
  const Map& map() const { return *maps_[current_]; }
  Pose PreviousPose() const;
  Pose PredictPose(double timestamp_s) const;

  TrackerOptions options_;
  StageTimes* times_;
  std::optional<CameraModel> camera_;
  std::vector<std::unique_ptr<Map>> maps_;
  std::vector<PlaceIndex> places_;  // of each map
  std::size_t current_ = 0;         // the map in use, unless `has_map_` is false
  std::vector<FrameRecord> records_;
  std::int64_t next_keyframe_id_ = 0;
  bool is_map_loaded_ = false;            // and no frame has come since
  std::size_t num_loaded_keyframes_ = 0;  // of map 0, of other footage

  bool has_map_ = false;
  Backlog backlog_;
  MapInitialiser initialiser_;    // of the start to come
  std::optional<View> previous_;  // the last tracked frame
  std::size_t previous_record_ = 0;
  std::optional<Pose> velocity_;    // T_current_previous of the last two tracked frames
  double velocity_duration_s_ = 0;  // between those two
  KeyframeId reference_ = 0;        // the keyframe that shares most points with the last frame
  KeyframeId newest_ = 0;
  std::optional<double> lost_since_s_;

  PublishedPoses poses_;
  bool is_publication_due_ = false;         // keyframes have come or moved since the last one
  TrackingLock* lock_ = nullptr;            // while a frame is tracked live
  std::unique_ptr<MappingThread> mapping_;  // live only; ends first
};

}  // namespace mono3d::tracking
