// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "mono3d/tracking/tracker.h"
#include "tracking/atlas.h"
#include "tracking/backlog.h"
#include "tracking/frame_tracker.h"
#include "tracking/mapping/local_mapper.h"
#include "tracking/mapping_thread.h"
#include "tracking/places/loop_closer.h"
#include "tracking/positions/position_follower.h"
#include "tracking/start/map_initialiser.h"
#include "tracking/turn_on_the_spot.h"

namespace mono3d::tracking {

// The tracker that CreateTracker makes: it runs the stages in their order. Live, mapping runs in a
// thread of its own, with the same functions as in sequential mode; whichever thread holds the lock
// may touch the members.
class MonocularTracker final : public Tracker {
 public:
  MonocularTracker(const TrackerOptions& options, StageTimes* times);

  TrackingResult Track(const Frame& frame) override;
  KeyframePosesPtr Poses() const override { return atlas_.Poses(); }
  void WaitForMapping() override;
  std::vector<Keyframe> Finish() override;
  std::vector<TrajectoryEntry> Trajectory() const override;
  std::vector<TrajectoryEntry> KeyframeTrajectory() const override;
  void Constrain(std::span<const KeyframeConstraint> constraints) override;
  void FollowPositions(const CameraPositions& positions) override;
  std::vector<PositionFit> PositionFits() const override;
  SparseModel Sparse(int map_id) const override;
  std::string SaveMap() const override;
  void LoadMap(std::string_view bytes, const std::string& where) override;
  std::string SaveState(SavedImages images) const override;
  void RestoreState(std::string_view bytes, const std::string& where,
                    const ImageOfFrame& images) override;

 private:
  template <typename Archive>
  void ExchangeState(Archive& archive);
  bool IsConsistent() const;
  TrackingResult TrackView(View view);
  TrackingResult UndoTurn(TrackingResult result);
  // Without a map.
  TrackingResult Initialise(View view);
  std::optional<TrackingResult> Return(View& view);
  std::vector<FramePose> StartMap(const MapStart& start);
  // In the map in use.
  TrackingResult Follow(View view);
  TrackingResult Continue(View view, const PoseResult& pose);
  TrackingResult Lose(const View& view, const std::string& reason);
  FrameTracker::State TrackBetween(const std::vector<Frame>& frames);
  void TrackBacklog(const std::vector<Frame>& frames, bool may_insert);
  std::vector<FramePose> TrackLostFrames();
  bool InsertIfNeeded(View& view, const PoseResult& pose);
  std::optional<KeyframeId> NewestIf(bool is_keyframe) const {
    return is_keyframe ? std::optional<KeyframeId>(atlas_.newest()) : std::nullopt;
  }
  // The mapping.
  void MapKeyframe(KeyframeId keyframe, MappingLock& lock);
  void SettleYoungMap(KeyframeId keyframe, MappingLock& lock);
  void Settle(MappingLock& lock);
  std::vector<Keyframe> HandOver();
  std::vector<Keyframe> HandOverAll(bool are_frames_waiting);
  bool ClosePlaces(KeyframeId keyframe, MappingLock& lock);
  bool FollowModel(MappingLock& lock);
  void AdjustWhatIsLeft(MappingLock& alone);
  bool FollowNewPositions(std::size_t map, bool is_growing, MappingLock& lock);
  void RequestAdjustment(const MappingLock& lock);
  MappingWork BackgroundWork();
  // Null in sequential mode.
  std::unique_ptr<TrackingLock> Lock() const;
  void PublishPoses();

  TrackerOptions options_;
  StageTimes* times_;
  std::optional<CameraModel> camera_;  // of all frames
  Atlas atlas_;
  FrameTracker frame_tracker_;
  LocalMapper local_mapper_;
  LoopCloser loop_closer_;
  MapInitialiser initialiser_;  // of the start to come
  Backlog backlog_;
  // Of the latest map: how many keyframes it had when all of it was adjusted to what the model
  // says, and whether it has followed the model since then.
  std::int64_t num_adjusted_keyframes_ = 0;
  bool is_adjustment_left_ = false;
  bool is_publication_due_ = false;  // keyframes have come or moved since the last snapshot
  TurnOnTheSpot turn_;
  PositionFollower positions_;
  mutable std::size_t last_state_bytes_ = 0;  // as the next state will have, about
  bool may_return_ = true;                    // to a map that was left
  TrackingLock* lock_ = nullptr;              // while a frame is tracked live
  std::unique_ptr<MappingThread> mapping_;    // live only; ends first
};

}  // namespace mono3d::tracking
