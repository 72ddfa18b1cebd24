// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/orb_tracker.h"

#include <algorithm>
#include <string>
#include <utility>

#include "mono3d/core/error.h"
#include "tracking/direct_tracking.h"
#include "tracking/keyframe_insertion.h"
#include "tracking/local_mapping.h"
#include "tracking/relocalisation.h"
#include "tracking/scaling_tracker.h"

namespace mono3d::tracking {
namespace {

std::string NeededInliers(int found, const char* what, int needed) {
  return std::to_string(found) + " " + what + ", " + std::to_string(needed) + " needed";
}

TrackingResult NotInitialised(std::string reason) {
  TrackingResult result;
  result.reason = std::move(reason);
  return result;
}

}  // namespace

OrbTracker::OrbTracker(const TrackerOptions& options, StageTimes* times)
    : options_(options),
      times_(times),
      backlog_(static_cast<std::size_t>(1e6 * std::max(0.0, options.initialisation.max_kept_mb))),
      initialiser_(options.initialisation, options.seed) {
  options_.Validate();
  if (options_.mode == "live") mapping_ = std::make_unique<MappingThread>(BackgroundWork());
}

TrackingResult OrbTracker::Track(const Frame& frame) {
  Validate(frame);
  if (camera_ && !(*camera_ == frame.camera)) {
    throw Error(ErrorParts{.what = "camera differs from the first frame's",
                           .where = frame.name,
                           .expected = "one camera for all frames",
                           .found = {}});
  }
  View view = MakeView(frame);
  const std::unique_ptr<TrackingTurn> turn = TakeTurn();
  turn_ = turn.get();
  if (mapping_) mapping_->WaitForRoom(*turn);
  camera_ = frame.camera;
  if (is_map_loaded_) JoinLoadedFrames(frame);
  // What has been mapped meanwhile has moved the last view, too.
  if (mapping_ && previous_) previous_->T_cam_world = PreviousPose();
  if (has_map_) map().ReleaseRemoved(previous_ ? &*previous_ : nullptr);
  TrackingResult result = has_map_ ? Follow(std::move(view)) : Initialise(std::move(view));
  if (!result.T_world_cam) backlog_.Add(frame);
  if (mapping_) HandOver(result);
  return result;
}

View OrbTracker::MakeView(const Frame& frame) const {
  const ScopedStageTimer timer(times_, "tracking/octaves");
  View view;
  view.frame = frame;
  view.octaves = BuildOctaves(ToGrey(frame.bgr));
  return view;
}

// Features all over the view, besides those that have a point already.
void OrbTracker::AddFeatures(View& view) const {
  const ScopedStageTimer timer(times_, "tracking/features");
  std::vector<Feature> known;
  std::vector<std::optional<PointId>> points;
  for (std::size_t i = 0; i < view.features.size(); ++i) {
    if (!view.points[i]) continue;
    known.push_back(view.features[i]);
    points.push_back(view.points[i]);
  }
  const int num_features =
      options_.features.num_features * (has_map_ && !SharesLittle(view) ? 1 : 2);
  view.features = ExtractFeatures(view.octaves[0], options_.features, num_features, known);
  view.grid = FeatureGrid(view.features, view.frame.camera.width, view.frame.camera.height);
  view.points = std::move(points);
  view.points.resize(view.features.size());
}

// Between few images a second, does the camera leave more than half of what it saw? Of what is left
// the third image shows a part again, and on that its pose must rest.
bool OrbTracker::SharesLittle(const View& view) const {
  if (!has_map_ || !previous_ || lost_since_s_) return false;
  int num_before = 0;
  int num_in_view = 0;
  for (const std::optional<PointId>& point : previous_->points) {
    if (!point || !map().point(*point).alive) continue;
    ++num_before;
    const Eigen::Vector3d p_cam = view.T_cam_world * map().point(*point).p_world;
    if (p_cam.z() > 0 && map().camera().Contains(map().camera().Project(p_cam))) ++num_in_view;
  }
  return 2 * num_in_view < num_before;
}

TrackingResult OrbTracker::Initialise(View view) {
  AddFeatures(view);
  if (std::optional<TrackingResult> returned = Return(view)) return *std::move(returned);
  const ScopedStageTimer timer(times_, "tracking/initialisation");
  std::string reason;
  std::optional<MapStart> start = initialiser_.Add(std::move(view), reason);
  if (!start) {
    TrackingResult waiting = NotInitialised(std::move(reason));
    waiting.map_id = static_cast<int>(maps_.size());
    return waiting;
  }
  TrackingResult result;
  result.recovered = StartMap(*start);
  View second = map().keyframe(1).view;
  result.status = TrackingStatus::kTracking;
  result.map_id = map().id();
  result.T_world_cam = second.T_cam_world.Inverse();
  result.is_keyframe = true;
  result.num_inliers = static_cast<int>(map().Depths(second).size());
  Remember(std::move(second));
  return result;
}

// Directly where the prediction holds, else by features.
PoseResult OrbTracker::FindPose(View& view) {
  const ScopedStageTimer timer(times_, "tracking/frame_tracking");
  // Fewer than this share of the previous view's points that should show: the prediction was
  // wrong.
  constexpr double kMinKeptShare = 0.4;
  PoseResult pose;
  if (!lost_since_s_) {
    view.T_cam_world = PredictPose(view.frame.timestamp_s);
    pose = TrackDirectly(map(), *previous_, view);
    if (pose.num_inliers >= options_.min_inliers &&
        pose.num_inliers >= kMinKeptShare * CountExpected(map(), *previous_, view)) {
      return pose;
    }
  }
  return FindPoseByFeatures(view);
}

PoseResult OrbTracker::FindPoseByFeatures(View& view) {
  constexpr int kMinForPatches = 10;  // a pose that rests on fewer is a guess
  view.points.clear();
  view.features.clear();
  if (!lost_since_s_) view.T_cam_world = PredictPose(view.frame.timestamp_s);
  AddFeatures(view);
  PoseResult pose;
  if (lost_since_s_) {
    pose = Recover(view);
  } else {
    pose = TrackFromPrevious(map(), *previous_, view);
    if (pose.num_inliers < 10) {
      view.T_cam_world = PreviousPose();
      pose = TrackFromKeyframe(map(), reference_, view);
    }
    if (pose.num_inliers >= 10) pose = TrackLocalMap(map(), view);
    if (pose.num_inliers < options_.min_inliers) {
      const PoseResult recovered = Recover(view);
      if (recovered.num_inliers >= options_.min_inliers) pose = recovered;
    }
  }
  return pose.num_inliers < kMinForPatches ? pose : Sharpen(view, pose);
}

// The patches know better where the points are, and find those that are no corners here.
PoseResult OrbTracker::Sharpen(View& view, const PoseResult& pose) {
  View sharpened = view;
  const PoseResult by_patches = TrackPatches(map(), view, sharpened);
  if (2 * by_patches.num_inliers < pose.num_inliers) return pose;
  view = std::move(sharpened);
  return by_patches;
}

TrackingResult OrbTracker::Follow(View view) {
  const PoseResult pose = FindPose(view);
  if (pose.num_inliers < options_.min_inliers) {
    return Lose(view,
                NeededInliers(pose.num_inliers, "map points found again", options_.min_inliers));
  }
  return Continue(std::move(view), pose);
}

// The motion since the previous view, and the keyframe that shares most with this one.
void OrbTracker::UpdateMotion(const View& view) {
  velocity_.reset();
  if (previous_ && !lost_since_s_) {
    velocity_ = view.T_cam_world * PreviousPose().Inverse();
    velocity_duration_s_ = view.frame.timestamp_s - previous_->frame.timestamp_s;
  }
  const std::vector<Covisible> seeing = map().KeyframesSeeing(view.points);
  if (!seeing.empty()) reference_ = seeing.front().keyframe;
}

TrackingResult OrbTracker::Continue(View view, const PoseResult& pose) {
  UpdateMotion(view);
  const bool was_lost = lost_since_s_.has_value() || backlog_.size() > 0;
  lost_since_s_.reset();

  TrackingResult result;
  result.status = TrackingStatus::kTracking;
  result.map_id = map().id();
  result.num_inliers = pose.num_inliers;
  result.reprojection_px = pose.reprojection_px;
  result.is_keyframe = InsertIfNeeded(view, pose, MapWhen::kWhenThereIsTime);
  if (result.is_keyframe && !mapping_) {
    MappingTurn alone;
    const bool has_moved = RecognisePlace(newest_, alone);
    if (FollowModel(alone) || has_moved) result.corrections = CorrectionsOf(map());
    result.map_id = map().id();  // another one where two were joined
    result.finalised_keyframes = TakeFinalised(map(), false, next_keyframe_id_);
  }
  if (result.is_keyframe) view = map().keyframe(newest_).view;
  result.T_world_cam = view.T_cam_world.Inverse();
  Remember(std::move(view));
  if (was_lost) result.recovered = TrackLostFrames();
  return result;
}

TrackingResult OrbTracker::Lose(const View& view, const std::string& reason) {
  if (!lost_since_s_) lost_since_s_ = view.frame.timestamp_s;
  const bool is_over = view.frame.timestamp_s - *lost_since_s_ >= options_.recovery_s;
  // A map that is left is complete: what is mapped in the background is of the map in use.
  if (is_over && mapping_) mapping_->Wait(*turn_);
  TrackingResult result;
  result.status = TrackingStatus::kLost;
  result.reason = reason;
  result.map_id = map().id();
  if (is_over) {
    result.finalised_keyframes = TakeFinalised(map(), true, next_keyframe_id_);
    result.reason += "; starting anew";
    has_map_ = false;
    previous_.reset();
    velocity_.reset();
    lost_since_s_.reset();
  }
  return result;
}

PoseResult OrbTracker::Recover(View& view) {
  const ScopedStageTimer timer(times_, "tracking/relocalisation");
  return RelocaliseInMap(map(), places_[current_], view, options_.min_inliers, options_.seed);
}

bool OrbTracker::InsertIfNeeded(View& view, const PoseResult& pose, MapWhen when) {
  InsertionEvidence evidence;
  const Pose T_newest = map().T_cam_world(newest_);
  evidence.T_current_last = view.T_cam_world * T_newest.Inverse();
  evidence.T_current_previous = velocity_.value_or(Pose());
  evidence.is_last_previous =
      previous_ && previous_->frame.index == map().keyframe(newest_).view.frame.index;
  evidence.median_depth_su = Median(map().Depths(view));
  evidence.num_inliers = pose.num_inliers;
  constexpr std::size_t kYoung = 5;  // keyframes
  evidence.is_young = map().keyframes().size() < kYoung;
  evidence.num_reference_points = CountTrackable(map(), map().keyframe(reference_).view);
  if (!NeedsKeyframe(evidence, options_.insertion)) return false;
  AddFeatures(view);
  newest_ = map().AddKeyframe(view);
  reference_ = newest_;
  if (mapping_ && when == MapWhen::kWhenThereIsTime) {
    mapping_->Add(newest_);
    return true;
  }
  MappingTurn alone;
  MapKeyframeInto(map(), newest_, options_.mapping, times_, alone);
  return true;
}

void OrbTracker::Remember(View view) {
  KeyframeId keyframe = reference_;
  while (!map().keyframe(keyframe).alive) --keyframe;
  previous_record_ = records_.size();
  records_.push_back(MakeRecord(view, map(), keyframe));
  view.frame.bgr.release();
  previous_ = std::move(view);
}

Pose OrbTracker::PreviousPose() const { return PoseOf(records_[previous_record_], map()); }

// Constant velocity, also over frames left out.
Pose OrbTracker::PredictPose(double timestamp_s) const {
  if (!velocity_) return PreviousPose();
  const double duration_s = timestamp_s - previous_->frame.timestamp_s;
  const double factor = velocity_duration_s_ > 0 ? duration_s / velocity_duration_s_ : 1;
  return ScaleMotion(*velocity_, factor) * PreviousPose();
}

std::vector<Keyframe> OrbTracker::Finish() {
  const std::unique_ptr<TrackingTurn> turn = TakeTurn();
  if (mapping_) mapping_->Wait(*turn);
  if (!has_map_) return {};
  return TakeFinalised(map(), true, next_keyframe_id_);
}

std::vector<TrajectoryEntry> OrbTracker::Trajectory() const {
  const std::unique_ptr<TrackingTurn> turn = TakeTurn();
  return ToTrajectory(records_, maps_);
}

std::vector<TrajectoryEntry> OrbTracker::KeyframeTrajectory() const {
  const std::unique_ptr<TrackingTurn> turn = TakeTurn();
  std::vector<TrajectoryEntry> entries;
  for (const std::unique_ptr<Map>& of : maps_) {
    for (const KeyframeId id : InOrderOfFlight(*of)) {
      if (of->id() == 0 && id < num_loaded_keyframes_) continue;
      const Frame& frame = of->keyframe(id).view.frame;
      entries.push_back({frame.index, frame.timestamp_s, of->id(), of->T_cam_world(id).Inverse()});
    }
  }
  return entries;
}

}  // namespace mono3d::tracking

namespace mono3d {

std::unique_ptr<Tracker> CreateTracker(const TrackerOptions& options, StageTimes* times) {
  return std::make_unique<tracking::ScalingTracker>(
      std::make_unique<tracking::OrbTracker>(options, times), options.max_side_px);
}

}  // namespace mono3d
