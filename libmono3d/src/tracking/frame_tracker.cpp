// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/frame_tracker.h"

#include <utility>
#include <vector>

#include "image/state_archive.h"
#include "mono3d/core/statistics.h"
#include "mono3d/image/keyframe.h"
#include "tracking/alignment/octaves.h"
#include "tracking/alignment/patch_tracking.h"
#include "tracking/alignment/sharpness.h"
#include "tracking/features/feature_extraction.h"
#include "tracking/features/feature_grid.h"
#include "tracking/features/feature_tracking.h"
#include "tracking/map/depth_uncertainty.h"
#include "tracking/map/map_checks.h"
#include "tracking/map/map_state.h"
#include "tracking/optimisation/pose_optimisation.h"
#include "tracking/optimisation/view_pose.h"

namespace mono3d::tracking {

View FrameTracker::MakeView(const Frame& frame) const {
  const ScopedStageTimer timer(times_, "tracking/octaves");
  View view;
  view.frame = frame;
  view.octaves = BuildOctaves(ToGrey(frame.bgr));
  view.log_sharpness = LogSharpness(view.octaves);
  return view;
}

void FrameTracker::AddFeatures(View& view) const {
  const ScopedStageTimer timer(times_, "tracking/features");
  std::vector<Feature> known;
  std::vector<std::optional<PointId>> points;
  for (std::size_t i = 0; i < view.features.size(); ++i) {
    if (!view.points[i]) continue;
    known.push_back(view.features[i]);
    points.push_back(view.points[i]);
  }
  const int num_features =
      options_.features.num_features * (atlas_->IsInUse() && !SharesLittle(view) ? 1 : 2);
  view.features = ExtractFeatures(view.octaves[0], options_.features, num_features, known);
  view.grid = FeatureGrid(view.features, view.frame.camera.width, view.frame.camera.height);
  view.points = std::move(points);
  view.points.resize(view.features.size());
}

// Between few images a second, does the camera leave more than half of what it saw? Of what is left
// the third image shows a part again, and on that its pose must rest.
bool FrameTracker::SharesLittle(const View& view) const {
  if (!atlas_->IsInUse() || !state_.previous || lost_since_s_) return false;
  const Map& map = atlas_->map();
  int num_before = 0;
  int num_in_view = 0;
  for (const std::optional<PointId>& point : state_.previous->points) {
    if (!point || !map.IsAlive(*point)) continue;
    ++num_before;
    const Eigen::Vector3d p_cam = view.T_cam_world * map.point(*point).p_world;
    if (p_cam.z() > 0 && map.camera().Contains(map.camera().Project(p_cam))) ++num_in_view;
  }
  return 2 * num_in_view < num_before;
}

// Directly where the prediction holds, else by features.
PoseResult FrameTracker::FindPose(View& view) const {
  const ScopedStageTimer timer(times_, "tracking/frame_tracking");
  // Fewer than this share of the previous view's points that should show: the prediction was
  // wrong.
  constexpr double kMinKeptShare = 0.4;
  PoseResult pose;
  if (!lost_since_s_) {
    const View& previous = *state_.previous;
    view.T_cam_world = PredictPose(view.frame.timestamp_s);
    PredictVelocity(view);
    pose = TrackDirectly(atlas_->map(), previous, view);
    if (pose.num_inliers >= options_.min_inliers &&
        CountTracked(atlas_->map(), view) >=
            kMinKeptShare * CountExpected(atlas_->map(), previous, view)) {
      return pose;
    }
  }
  return FindPoseByFeatures(view);
}

PoseResult FrameTracker::FindPoseByFeatures(View& view) const {
  view.points.clear();
  view.features.clear();
  if (!lost_since_s_) view.T_cam_world = PredictPose(view.frame.timestamp_s);
  AddFeatures(view);
  PoseResult pose;
  if (lost_since_s_) {
    pose = Relocalise(atlas_->current(), view);
  } else {
    pose = TrackFromPrevious(atlas_->map(), *state_.previous, view);
    if (pose.num_inliers < kMinPoseInliers) {
      view.T_cam_world = PreviousPose();
      pose = TrackFromKeyframe(atlas_->map(), state_.reference, view);
    }
    if (pose.num_inliers >= kMinPoseInliers) pose = TrackLocalMap(atlas_->map(), view);
    if (pose.num_inliers < options_.min_inliers) {
      const PoseResult recovered = Relocalise(atlas_->current(), view);
      if (recovered.num_inliers >= options_.min_inliers) pose = recovered;
    }
  }
  return pose.num_inliers < kMinPoseInliers ? pose : RefineByPatchAlignment(view, pose);
}

PoseResult FrameTracker::Relocalise(std::size_t map, View& view) const {
  const ScopedStageTimer timer(times_, "tracking/relocalisation");
  return relocaliser_.Relocalise(atlas_->map(map), atlas_->places(map), view);
}

PoseResult FrameTracker::RefineByPatchAlignment(View& view, const PoseResult& pose) const {
  View refined = view;
  const PoseResult by_patches = TrackPatches(atlas_->map(), view, refined);
  if (2 * by_patches.num_inliers < pose.num_inliers) return pose;
  view = std::move(refined);
  return by_patches;
}

void FrameTracker::PredictVelocity(View& view) const {
  view.velocity_prior = state_.motion.Velocity(0);
  view.shutter = {view.frame.sensor, view.velocity_prior.mean};
}

// Between two motions the velocity is known better than at the end of one, and between four again.
void FrameTracker::ImprovePrevious() {
  if (state_.earlier) {
    Improve(2, state_.earlier_frame, state_.keyframe_before, *state_.earlier);
  }
  Improve(1, state_.previous_frame, state_.previous_keyframe, *state_.previous);
}

// The velocity of a keyframe is not taken from its own image: with points and poses free as well,
// velocities that are free fold a map.
void FrameTracker::Improve(std::size_t num_before, std::size_t frame,
                           std::optional<KeyframeId> keyframe, View& view) {
  Map& map = atlas_->map();
  const VelocityPrior velocity = state_.motion.Velocity(num_before);
  if (keyframe) {
    View& of_map = map.keyframe(*keyframe).view;
    of_map.shutter = {of_map.frame.sensor, velocity.mean};
    return;
  }
  if (view.frame.sensor.shutter.IsGlobal()) return;
  const Pose before = atlas_->T_cam_world(frame);
  View improved = view;
  improved.T_cam_world = before;
  improved.velocity_prior = velocity;
  if (RefinePose(map, improved).num_inliers < options_.min_inliers) return;
  view = std::move(improved);
  atlas_->MoveFrame(frame, view);
  state_.motion.Move(num_before, view.T_cam_world * before.Inverse());
}

void FrameTracker::AddMotionTo(KeyframeId keyframe) {
  View& view = atlas_->map().keyframe(keyframe).view;
  state_.motion.Add(view.T_cam_world * PreviousPose().Inverse(),
                    view.frame.timestamp_s - state_.previous->frame.timestamp_s);
  ImprovePrevious();
  PredictVelocity(view);
}

void FrameTracker::UpdateMotion(View& view) {
  Map& map = atlas_->map();
  if (!state_.previous || lost_since_s_) {
    state_.motion.Reset();
  } else {
    state_.motion.Add(view.T_cam_world * PreviousPose().Inverse(),
                      view.frame.timestamp_s - state_.previous->frame.timestamp_s);
    ImprovePrevious();
    PredictVelocity(view);
    if (!view.frame.sensor.shutter.IsGlobal()) {
      const Pose before = view.T_cam_world;
      static_cast<void>(RefinePose(map, view));
      state_.motion.Move(0, view.T_cam_world * before.Inverse());
    }
  }
  const std::vector<Covisible> seeing = atlas_->map().KeyframesSeeing(view.points);
  if (!seeing.empty()) state_.reference = seeing.front().keyframe;
}

void FrameTracker::Remember(View view, std::optional<KeyframeId> keyframe) {
  state_.keyframe_before = state_.previous_keyframe;
  state_.earlier.reset();
  const bool is_next = state_.previous && !view.frame.sensor.shutter.IsGlobal();
  if (is_next) state_.earlier = std::move(state_.previous);
  state_.earlier_frame = state_.previous_frame;
  state_.previous_keyframe = keyframe;
  if (keyframe) state_.sharpness.Clear();
  state_.sharpness.Add(view.log_sharpness);
  state_.previous_frame = atlas_->AddFrame(view, state_.reference);
  refiner_.Add(state_.previous_frame, view);
  view.frame.bgr.release();
  state_.previous = std::move(view);
}

InsertionEvidence FrameTracker::EvidenceFor(const View& view, const PoseResult& pose) const {
  const Map& map = atlas_->map();
  InsertionEvidence evidence;
  evidence.T_current_last = view.T_cam_world * map.T_cam_world(atlas_->newest()).Inverse();
  evidence.T_current_previous = state_.motion.last().value_or(Pose());
  evidence.is_last_previous =
      state_.previous &&
      state_.previous->frame.index == map.keyframe(atlas_->newest()).view.frame.index;
  evidence.median_depth_su = UpperMedianOrZero(map.Depths(view));
  evidence.num_inliers = pose.num_inliers;
  constexpr std::size_t kYoung = 5;  // keyframes: before, the points rest on few views
  // The same where most are directions: a baseline gives them their depths.
  constexpr double kMany = 0.5;
  evidence.is_young = map.keyframes().size() < kYoung || ShareOfDirections(map, view) > kMany;
  evidence.is_blurred = state_.sharpness.IsBlurred(view.log_sharpness);
  evidence.is_sharp = state_.sharpness.IsSharp(view.log_sharpness);
  evidence.num_reference_points = CountTrackable(map, map.keyframe(state_.reference).view);
  return evidence;
}

void FrameTracker::Renumber(const NumberShift& shift) {
  refiner_.Renumber(shift);
  state_.reference += shift.keyframes;
  for (std::optional<KeyframeId>* id : {&state_.previous_keyframe, &state_.keyframe_before}) {
    if (*id) **id += shift.keyframes;
  }
  for (std::optional<View>* view : {&state_.previous, &state_.earlier}) {
    if (!*view) continue;
    for (std::optional<PointId>& point : (*view)->points) {
      if (point) point->index += shift.points;
    }
  }
}

void FrameTracker::FollowMap() {
  if (state_.previous) state_.previous->T_cam_world = PreviousPose();
}

void FrameTracker::SetLost(double timestamp_s) {
  if (!lost_since_s_) lost_since_s_ = timestamp_s;
}

void FrameTracker::Reset() {
  state_.previous.reset();
  state_.earlier.reset();
  state_.previous_keyframe.reset();
  state_.keyframe_before.reset();
  state_.motion.Reset();
  state_.sharpness.Clear();
  lost_since_s_.reset();
}

// Constant velocity, also over frames left out.
Pose FrameTracker::PredictPose(double timestamp_s) const {
  const std::optional<Pose> motion =
      state_.motion.Predict(timestamp_s - state_.previous->frame.timestamp_s);
  return motion ? *motion * PreviousPose() : PreviousPose();
}

template <typename Archive>
void FrameTracker::ExchangeState(Archive& archive) {
  const auto exchange_view = [&](View& view) { tracking::ExchangeState(archive, view); };
  const auto exchange_keyframe = [&](KeyframeId& keyframe) { archive.Index(keyframe); };
  archive.Optional(state_.previous, exchange_view);
  archive.Index(state_.previous_frame);
  archive.Optional(state_.earlier, exchange_view);
  archive.Index(state_.earlier_frame);
  archive.Optional(state_.previous_keyframe, exchange_keyframe);
  archive.Optional(state_.keyframe_before, exchange_keyframe);
  archive.Index(state_.reference);
  state_.motion.ExchangeState(archive);
  state_.sharpness.ExchangeState(archive);
  archive.Optional(lost_since_s_, [&](double& time_s) { archive.Number(time_s); });
  refiner_.ExchangeState(archive);
  if constexpr (Archive::kReads) {
    if (!IsConsistent()) archive.Refuse("contradicts itself");
  }
}

template void FrameTracker::ExchangeState(StateWriter&);
template void FrameTracker::ExchangeState(StateReader&);

// Where no map is in use, everything else is set with the next one that is.
bool FrameTracker::IsConsistent() const {
  if (!atlas_->IsInUse()) return !state_.previous && !state_.earlier;
  const Map& map = atlas_->map();
  const auto is_frame = [&](std::size_t frame, const View& view) {
    return frame < atlas_->num_frames() && atlas_->map_of_frame(frame) == atlas_->current() &&
           IsViewOf(map, view) && !view.octaves.empty() && !view.grid.IsEmpty();
  };
  const auto is_keyframe = [&](const std::optional<KeyframeId>& keyframe) {
    return !keyframe || IsKeyframeOf(map, *keyframe);
  };
  return state_.previous && is_frame(state_.previous_frame, *state_.previous) &&
         (!state_.earlier || is_frame(state_.earlier_frame, *state_.earlier)) &&
         IsKeyframeOf(map, state_.reference) && is_keyframe(state_.previous_keyframe) &&
         is_keyframe(state_.keyframe_before);
}

}  // namespace mono3d::tracking
