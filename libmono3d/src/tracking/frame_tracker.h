// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <optional>

#include "mono3d/core/timing.h"
#include "mono3d/tracking/tracker.h"
#include "tracking/alignment/sharpness.h"
#include "tracking/atlas.h"
#include "tracking/frame_refiner.h"
#include "tracking/map/map.h"
#include "tracking/mapping/keyframe_insertion.h"
#include "tracking/motion_model.h"
#include "tracking/optimisation/view_pose.h"
#include "tracking/places/relocaliser.h"

namespace mono3d::tracking {

// Finds the pose of one frame after the other in the map in use: from where the motion of the last
// ones has it, by patches, else by features; after a loss all over the map.
class FrameTracker {
 public:
  // Where tracking goes on from.
  struct State {
    std::optional<View> previous;    // the last tracked frame, without its image
    std::size_t previous_frame = 0;  // its number in the atlas, whose pose follows the map
    // With a rolling shutter the one before it.
    std::optional<View> earlier;
    std::size_t earlier_frame = 0;
    std::optional<KeyframeId> previous_keyframe;  // where it is one
    std::optional<KeyframeId> keyframe_before;    // the same of the frame before it
    KeyframeId reference = 0;                     // the keyframe that shares most points with it
    MotionModel motion;
    SharpnessHistory sharpness;  // of the frames from the newest keyframe on
  };

  // All must outlive it, but for `options`; `times` may be null.
  FrameTracker(const TrackerOptions& options, StageTimes* times, Atlas* atlas)
      : options_(options),
        times_(times),
        atlas_(atlas),
        refiner_(atlas, options.min_inliers),
        relocaliser_(options.min_inliers, options.seed) {}

  // With the octaves of the image, without features.
  View MakeView(const Frame& frame) const;
  // Features all over the view, besides those that have a point already.
  void AddFeatures(View& view) const;

  // Both give the view its pose and points. It has one if that rests on min_inliers points.
  PoseResult FindPose(View& view) const;
  // From nothing but the view's features, in any map.
  PoseResult Relocalise(std::size_t map, View& view) const;
  // By the patches of the map in use, from a pose found by features: they know better where the
  // points are, and find those that are no corners here.
  PoseResult RefineByPatchAlignment(View& view, const PoseResult& pose) const;

  // The view has its pose: the motion since the one before, and the keyframe that shares most
  // points with it. With a rolling shutter the pose becomes better by the motion up to it, and that
  // of the view before by the motion after it.
  void UpdateMotion(View& view);
  // A tracked view, or the one of a keyframe, becomes the previous one.
  void Remember(View view, std::optional<KeyframeId> keyframe);
  FrameRefiner& refiner() { return refiner_; }
  // What is known of whether the view should become a keyframe.
  InsertionEvidence EvidenceFor(const View& view, const PoseResult& pose) const;

  const State& state() const { return state_; }
  void SetState(const State& state) { state_ = state; }
  void SetReference(KeyframeId keyframe) { state_.reference = keyframe; }
  void ExpectMotion(const Pose& T_next_current, double duration_s) {
    state_.motion.Expect(T_next_current, duration_s);
  }
  // A keyframe whose pose is known came next: its velocity is by the motion up to it.
  void AddMotionTo(KeyframeId keyframe);
  // The map has moved: lengths around the camera were multiplied by `ratio`.
  void Rescale(double ratio) { state_.motion.Rescale(ratio); }
  // Its map has gone into another one.
  void Renumber(const NumberShift& shift);
  // Before the next frame: what was mapped since the last one has moved it.
  void FollowMap();

  // Since the frame at this time there is no pose.
  void SetLost(double timestamp_s);
  const std::optional<double>& lost_since_s() const { return lost_since_s_; }
  void SetFound() { lost_since_s_.reset(); }
  // The map in use is left.
  void Reset();
  // Between two frames, for the archives of image/state_archive.h; after the atlas.
  template <typename Archive>
  void ExchangeState(Archive& archive);

 private:
  bool IsConsistent() const;
  bool SharesLittle(const View& view) const;
  PoseResult FindPoseByFeatures(View& view) const;
  Pose PreviousPose() const { return atlas_->T_cam_world(state_.previous_frame); }
  Pose PredictPose(double timestamp_s) const;
  void PredictVelocity(View& view) const;
  void ImprovePrevious();
  void Improve(std::size_t num_before, std::size_t frame, std::optional<KeyframeId> keyframe,
               View& view);

  TrackerOptions options_;
  StageTimes* times_;
  Atlas* atlas_;
  FrameRefiner refiner_;
  Relocaliser relocaliser_;
  State state_;
  std::optional<double> lost_since_s_;
};

}  // namespace mono3d::tracking
