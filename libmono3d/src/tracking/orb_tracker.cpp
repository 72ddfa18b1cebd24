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
#include "tracking/loop_closing.h"
#include "tracking/map_start.h"

namespace mono3d::tracking {
namespace {

std::string Needed(int found, const char* what, int needed) {
  return std::to_string(found) + " " + what + ", " + std::to_string(needed) + " needed";
}

TrackingResult NotInitialised(std::string reason) {
  TrackingResult result;
  result.reason = std::move(reason);
  return result;
}

}  // namespace

OrbTracker::OrbTracker(const TrackerOptions& options, StageTimes* times)
    : options_(options), times_(times), initialiser_(options.initialisation, options.seed) {
  options_.Validate();
}

TrackingResult OrbTracker::Track(const Frame& frame) {
  Validate(frame);
  if (camera_ && !(*camera_ == frame.camera)) {
    throw Error(ErrorParts{.what = "camera differs from the first frame's",
                           .where = frame.name,
                           .expected = "one camera for all frames",
                           .found = {}});
  }
  camera_ = frame.camera;
  View view = MakeView(frame);
  return has_map_ ? Follow(std::move(view)) : Initialise(std::move(view));
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
  const int num_features = options_.features.num_features * (has_map_ ? 1 : 2);
  view.features = ExtractFeatures(view.octaves[0], options_.features, num_features, known);
  view.grid = FeatureGrid(view.features, view.frame.camera.width, view.frame.camera.height);
  view.points = std::move(points);
  view.points.resize(view.features.size());
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
  maps_.push_back(
      std::make_unique<Map>(static_cast<int>(maps_.size()), *camera_, options_.features));
  FillMap(*start, next_keyframe_id_, map());
  next_keyframe_id_ += 2;
  places_.emplace_back();
  for (const KeyframeId id : {0, 1})
    places_.back().Add(id, FeaturesWithPoints(map().keyframe(id).view));
  has_map_ = true;
  newest_ = 1;
  const View& first = map().keyframe(0).view;
  records_.push_back({first.frame.index, first.frame.timestamp_s, map().id(), 0, {}, 1});
  reference_ = 0;
  for (View& between : start->between) FindBetween(std::move(between));
  reference_ = 1;

  View second = map().keyframe(1).view;
  TrackingResult result;
  result.status = TrackingStatus::kTracking;
  result.map_id = map().id();
  result.T_world_cam = second.T_cam_world.Inverse();
  result.is_keyframe = true;
  result.num_inliers = static_cast<int>(map().Depths(second).size());
  Remember(std::move(second));
  return result;
}

// Frames that came while the start was awaited get their poses after all.
void OrbTracker::FindBetween(View view) {
  view.T_cam_world = PreviousPose();
  const View first = previous_ ? *previous_ : map().keyframe(0).view;
  PoseResult pose = TrackDirectly(map(), first, view);
  if (pose.num_inliers >= options_.min_inliers) Remember(std::move(view));
}

// Directly where the prediction holds, else by features.
PoseResult OrbTracker::FindPose(View& view) {
  const ScopedStageTimer timer(times_, "tracking/frame_tracking");
  // Fewer points than this share of the previous view's: the prediction was wrong.
  constexpr double kMinKeptShare = 0.4;
  PoseResult pose;
  if (!lost_since_s_) {
    view.T_cam_world = PredictPose(view.frame.timestamp_s);
    pose = TrackDirectly(map(), *previous_, view);
    const double num_previous = static_cast<double>(map().Depths(*previous_).size());
    if (pose.num_inliers >= options_.min_inliers &&
        pose.num_inliers >= kMinKeptShare * num_previous) {
      return pose;
    }
  }
  return FindPoseByFeatures(view);
}

PoseResult OrbTracker::FindPoseByFeatures(View& view) {
  view.points.clear();
  view.features.clear();
  AddFeatures(view);
  PoseResult pose;
  if (lost_since_s_) {
    pose = Recover(view);
  } else {
    view.T_cam_world = PredictPose(view.frame.timestamp_s);
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
  return pose.num_inliers < options_.min_inliers ? pose : Sharpen(view, pose);
}

// The patches know better where the points are.
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
    return Lose(view, Needed(pose.num_inliers, "map points found again", options_.min_inliers));
  }
  return Continue(std::move(view), pose);
}

TrackingResult OrbTracker::Continue(View view, const PoseResult& pose) {
  velocity_.reset();
  if (previous_ && !lost_since_s_) {
    velocity_ = view.T_cam_world * PreviousPose().Inverse();
    velocity_duration_s_ = view.frame.timestamp_s - previous_->frame.timestamp_s;
  }
  lost_since_s_.reset();
  const std::vector<Covisible> seeing = map().KeyframesSeeing(view.points);
  if (!seeing.empty()) reference_ = seeing.front().keyframe;

  TrackingResult result;
  result.status = TrackingStatus::kTracking;
  result.map_id = map().id();
  result.num_inliers = pose.num_inliers;
  result.reprojection_px = pose.reprojection_px;
  result.is_keyframe = InsertIfNeeded(view, pose);
  if (result.is_keyframe) {
    result.corrections = CloseLoopIfAny();
    view = map().keyframe(newest_).view;
    result.settled_keyframes = TakeSettled(map(), false);
  }
  result.T_world_cam = view.T_cam_world.Inverse();
  Remember(std::move(view));
  return result;
}

TrackingResult OrbTracker::Lose(const View& view, const std::string& reason) {
  TrackingResult result;
  result.status = TrackingStatus::kLost;
  result.reason = reason;
  result.map_id = map().id();
  if (!lost_since_s_) lost_since_s_ = view.frame.timestamp_s;
  if (view.frame.timestamp_s - *lost_since_s_ >= options_.recovery_s) {
    result.settled_keyframes = TakeSettled(map(), true);
    result.reason += "; starting anew";
    has_map_ = false;
    previous_.reset();
    velocity_.reset();
    lost_since_s_.reset();
  }
  return result;
}

// The keyframes that look most like the view, then the newest.
std::vector<KeyframeId> OrbTracker::RecoveryCandidates(const View& view) const {
  constexpr std::size_t kMaxPlaces = 5;
  constexpr std::size_t kMaxCandidates = 8;
  std::vector<KeyframeId> candidates;
  for (const PlaceMatch& place : places_.back().Query(view.features, kMaxPlaces)) {
    if (map().keyframe(place.keyframe).alive) candidates.push_back(place.keyframe);
  }
  for (KeyframeId id = map().keyframes().size(); id-- > 0 && candidates.size() < kMaxCandidates;) {
    const bool is_listed = std::find(candidates.begin(), candidates.end(), id) != candidates.end();
    if (map().keyframe(id).alive && !is_listed) candidates.push_back(id);
  }
  return candidates;
}

PoseResult OrbTracker::Recover(View& view) {
  const ScopedStageTimer timer(times_, "tracking/relocalisation");
  // More than to go on tracking: a wrong place must not pass.
  const int needed = options_.min_inliers * 5 / 3;
  PoseResult best;
  for (const KeyframeId id : RecoveryCandidates(view)) {
    PoseResult pose = Relocalise(map(), id, view, options_.seed);
    if (pose.num_inliers >= 10) pose = TrackLocalMap(map(), view);
    if (pose.num_inliers >= needed) return pose;
    if (pose.num_inliers > best.num_inliers) best = pose;
  }
  best.num_inliers = std::min(best.num_inliers, options_.min_inliers - 1);
  return best;
}

// While no new map has started, the last one may come into view again.
std::optional<TrackingResult> OrbTracker::Return(View& view) {
  if (maps_.empty()) return std::nullopt;
  View returned = view;
  PoseResult pose = Recover(returned);
  if (pose.num_inliers < options_.min_inliers) return std::nullopt;
  pose = Sharpen(returned, pose);
  has_map_ = true;
  initialiser_ = Initialiser(options_.initialisation, options_.seed);
  return Continue(std::move(returned), pose);
}

bool OrbTracker::InsertIfNeeded(View& view, const PoseResult& pose) {
  InsertionEvidence evidence;
  const Pose T_newest = map().T_cam_world(newest_);
  evidence.T_current_last = view.T_cam_world * T_newest.Inverse();
  evidence.T_current_previous = velocity_.value_or(Pose());
  evidence.median_depth_su = Median(map().Depths(view));
  evidence.num_inliers = pose.num_inliers;
  constexpr std::size_t kYoung = 5;  // keyframes
  evidence.is_young = map().keyframes().size() < kYoung;
  evidence.num_reference_points = CountTrackable(map(), map().keyframe(reference_).view);
  if (!NeedsKeyframe(evidence, options_.insertion)) return false;
  AddFeatures(view);
  newest_ = map().AddKeyframe(view, next_keyframe_id_++);
  MapKeyframeInto(map(), newest_, options_.mapping, times_);
  reference_ = newest_;
  return true;
}

std::vector<KeyframeCorrection> OrbTracker::CloseLoopIfAny() {
  std::optional<Loop> loop;
  {
    const ScopedStageTimer timer(times_, "tracking/place_recognition");
    loop = FindLoop(map(), places_.back(), newest_, options_.seed);
    places_.back().Add(newest_, FeaturesWithPoints(map().keyframe(newest_).view));
  }
  if (!loop) return {};
  const ScopedStageTimer timer(times_, "tracking/loop_closing");
  const double scale_before = map().keyframe(newest_).scale;
  CloseLoop(map(), *loop, options_.mapping);
  if (velocity_) {
    const double ratio = map().keyframe(newest_).scale / scale_before;
    velocity_ = Pose(velocity_->rotation(), ratio * velocity_->translation());
  }
  return CorrectionsOf(map());
}

void OrbTracker::Remember(View view) {
  KeyframeId keyframe = reference_;
  while (!map().keyframe(keyframe).alive) --keyframe;
  records_.push_back({view.frame.index, view.frame.timestamp_s, map().id(), keyframe,
                      view.T_cam_world * map().T_cam_world(keyframe).Inverse(),
                      map().keyframe(keyframe).scale});
  view.frame.bgr.release();
  previous_ = std::move(view);
}

Pose OrbTracker::PoseOf(const Record& record) const {
  const Map& of = *maps_[static_cast<std::size_t>(record.map_id)];
  const double scale = of.keyframe(record.keyframe).scale / record.scale;
  const Pose T_cam_keyframe(record.T_cam_keyframe.rotation(),
                            scale * record.T_cam_keyframe.translation());
  return T_cam_keyframe * of.T_cam_world(record.keyframe);
}

Pose OrbTracker::PreviousPose() const { return PoseOf(records_.back()); }

// Constant velocity, also over frames left out.
Pose OrbTracker::PredictPose(double timestamp_s) const {
  if (!velocity_) return PreviousPose();
  const double duration_s = timestamp_s - previous_->frame.timestamp_s;
  const double factor = velocity_duration_s_ > 0 ? duration_s / velocity_duration_s_ : 1;
  return ScaleMotion(*velocity_, factor) * PreviousPose();
}

std::vector<Keyframe> OrbTracker::Finish() {
  if (!has_map_) return {};
  return TakeSettled(map(), true);
}

std::vector<TrajectoryEntry> OrbTracker::Trajectory() const {
  std::vector<TrajectoryEntry> entries;
  for (const Record& record : records_) {
    entries.push_back(
        {record.frame_index, record.timestamp_s, record.map_id, PoseOf(record).Inverse()});
  }
  std::stable_sort(entries.begin(), entries.end(),
                   [](const auto& a, const auto& b) { return a.frame_index < b.frame_index; });
  return entries;
}

std::vector<TrajectoryEntry> OrbTracker::KeyframeTrajectory() const {
  std::vector<TrajectoryEntry> entries;
  for (const std::unique_ptr<Map>& of : maps_) {
    for (KeyframeId id = 0; id < of->keyframes().size(); ++id) {
      const Frame& frame = of->keyframe(id).view.frame;
      entries.push_back({frame.index, frame.timestamp_s, of->id(), of->T_cam_world(id).Inverse()});
    }
  }
  return entries;
}

PointCloud OrbTracker::MapPoints(int map_id) const {
  PointCloud cloud;
  if (map_id < 0 || static_cast<std::size_t>(map_id) >= maps_.size()) return cloud;
  for (const MapPoint& point : maps_[static_cast<std::size_t>(map_id)]->points()) {
    if (!point.alive) continue;
    cloud.points.push_back(point.p_world.cast<float>());
    cloud.normals.push_back(point.towards_cameras.cast<float>());
    cloud.observations.push_back(static_cast<std::uint32_t>(point.observations.size()));
  }
  return cloud;
}

}  // namespace mono3d::tracking

namespace mono3d {

std::unique_ptr<Tracker> CreateTracker(const TrackerOptions& options, StageTimes* times) {
  return std::make_unique<tracking::OrbTracker>(options, times);
}

}  // namespace mono3d
