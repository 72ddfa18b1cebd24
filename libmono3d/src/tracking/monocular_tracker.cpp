// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/monocular_tracker.h"

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>

#include "core/option_state.h"
#include "geometry/geometry_state.h"
#include "image/state_archive.h"
#include "mono3d/core/error.h"
#include "mono3d/core/statistics.h"
#include "mono3d/image/keyframe.h"
#include "tracking/map/keyframe_handover.h"
#include "tracking/map/map_checks.h"
#include "tracking/mapping/point_creation.h"
#include "tracking/optimisation/constraint_following.h"
#include "tracking/optimisation/map_adjustment.h"
#include "tracking/optimisation/map_constraints.h"
#include "tracking/reason.h"
#include "tracking/start/map_start.h"

namespace mono3d::tracking {
namespace {

// By how much the points of a start move from its first image to the second: the median, in px.
double MedianShift(const MapStart& start) {
  std::vector<float> lengths;
  for (const FeatureMatch& match : start.motion.matches) {
    lengths.push_back(static_cast<float>(
        (start.second.features[match.feature_b].pixel - start.first.features[match.feature_a].pixel)
            .norm()));
  }
  return UpperMedianOrZero(std::move(lengths));
}

constexpr const char* kTrackerState = "tracker state";
constexpr std::uint32_t kTrackerStateVersion = 6;

void Append(std::vector<Keyframe> added, std::vector<Keyframe>& keyframes) {
  std::move(added.begin(), added.end(), std::back_inserter(keyframes));
}

bool HasRollingShutter(const Map& map) {
  return !map.keyframes().back().view.frame.sensor.shutter.IsGlobal();
}

// A map with a rolling shutter is young up to so many keyframes. Its start has velocities by poses
// that are wrong for the lack of them; more frames show how it was.
constexpr std::size_t kYoung = 24;

// Has the last keyframe of a young map been mapped? It has when it was adjusted together with the
// next one; or that will never be.
bool HasSettled(const Map& map) {
  constexpr std::size_t kMaxNewer = 8;
  const std::size_t count = map.keyframes().size();
  return count > kYoung + kMaxNewer ||
         (count > kYoung && map.keyframe(kYoung - 1).num_newer_adjusted > 0);
}

}  // namespace

MonocularTracker::MonocularTracker(const TrackerOptions& options, StageTimes* times)
    : options_(options),
      times_(times),
      atlas_(options.features),
      frame_tracker_(options, times, &atlas_),
      local_mapper_(options.mapping, times),
      loop_closer_(options, times, &atlas_),
      initialiser_(options.initialisation, options.seed),
      backlog_(static_cast<std::size_t>(1e6 * std::max(0.0, options.initialisation.max_kept_mb))),
      turn_(static_cast<std::size_t>(1e6 * std::max(0.0, options.initialisation.max_kept_mb))) {
  options_.Validate();
  if (options_.mode == "live") mapping_ = std::make_unique<MappingThread>(BackgroundWork());
}

TrackingResult MonocularTracker::Track(const Frame& frame) {
  Validate(frame);
  if (camera_ && !(*camera_ == frame.camera)) {
    throw Error(ErrorParts{.what = "camera differs from the first frame's",
                           .where = frame.name,
                           .expected = "one camera for all frames",
                           .found = {}});
  }
  View view = frame_tracker_.MakeView(frame);
  const std::unique_ptr<TrackingLock> lock = Lock();
  lock_ = lock.get();
  if (mapping_) mapping_->WaitForRoom(*lock);
  camera_ = frame.camera;
  atlas_.BeginFootage(frame);
  TrackingResult result = TrackView(std::move(view));
  while (turn_.IsRefused()) result = UndoTurn(std::move(result));
  if (mapping_ && atlas_.IsInUse() && !turn_.IsPending()) {
    std::vector<Keyframe> finalised = HandOver();
    if (!finalised.empty()) frame_tracker_.refiner().Refine();
    Append(std::move(finalised), result.finalised_keyframes);
  }
  if (is_publication_due_) PublishPoses();
  result.refined = atlas_.TakeMoved();
  return result;
}

TrackingResult MonocularTracker::TrackView(View view) {
  const Frame frame = view.frame;
  if (mapping_) frame_tracker_.FollowMap();
  TrackingResult result = atlas_.IsInUse() ? Follow(std::move(view)) : Initialise(std::move(view));
  if (!result.T_world_cam) backlog_.Add(frame);
  if (turn_.IsPending()) turn_.Keep(frame);
  return result;
}

// What was tracked after a turn on the spot has no scale in common with the map before it: the map
// is left as it was, and the frames are tracked anew, without it. `result`: of the last frame.
TrackingResult MonocularTracker::UndoTurn(TrackingResult result) {
  if (mapping_) mapping_->Wait(*lock_);
  const std::vector<Frame> frames = turn_.TakeBack(atlas_, frame_tracker_.refiner());
  Append(HandOverAll(mapping_ != nullptr), result.finalised_keyframes);
  frame_tracker_.refiner().Finish();
  positions_.NoteMoved();
  atlas_.Leave();
  frame_tracker_.Reset();
  initialiser_ = MapInitialiser(options_.initialisation, options_.seed);
  backlog_.Clear();
  result.pose.reset();
  may_return_ = false;
  std::vector<FramePose> recovered;
  for (const Frame& frame : frames) {
    if (result.pose) recovered.push_back(*result.pose);
    std::vector<Keyframe> finalised = std::move(result.finalised_keyframes);
    result = TrackView(frame_tracker_.MakeView(frame));
    if (mapping_) mapping_->WaitForRoom(*lock_);
    Append(std::move(result.finalised_keyframes), finalised);
    result.finalised_keyframes = std::move(finalised);
    recovered.insert(recovered.end(), result.recovered.begin(), result.recovered.end());
  }
  result.recovered = std::move(recovered);
  may_return_ = true;
  PublishPoses();
  return result;
}

TrackingResult MonocularTracker::Initialise(View view) {
  frame_tracker_.AddFeatures(view);
  if (std::optional<TrackingResult> returned = Return(view)) return *std::move(returned);
  const ScopedStageTimer timer(times_, "tracking/initialisation");
  TrackingResult result;
  const bool has_features =
      static_cast<int>(view.features.size()) >= options_.initialisation.min_matches;
  result.loss = has_features ? TrackingLoss::kNoStart : TrackingLoss::kTooFewFeatures;
  std::optional<MapStart> start = initialiser_.Add(std::move(view), result.reason);
  if (!start) {
    result.map_id = static_cast<int>(atlas_.num_maps());
    return result;
  }
  result.reason.clear();
  result.recovered = StartMap(*start);
  View second = atlas_.map().keyframe(1).view;
  // The map lets go of the octaves when many frames from before the start became keyframes.
  second.octaves = start->second.octaves;
  result.status = TrackingStatus::kTracking;
  result.map_id = atlas_.map().id();
  result.T_world_cam = second.T_cam_world.Inverse();
  result.is_keyframe = true;
  result.num_inliers = static_cast<int>(atlas_.map().Depths(second).size());
  frame_tracker_.Remember(std::move(second), 1);
  result.pose = atlas_.frame_pose(atlas_.num_frames() - 1);
  return result;
}

// While no new map has started, one of the known ones may come into view again, most likely the
// last one.
std::optional<TrackingResult> MonocularTracker::Return(View& view) {
  if (!may_return_) return std::nullopt;
  std::vector<std::size_t> order;
  for (std::size_t i = atlas_.num_maps(); i-- > 0;) {
    if (i != atlas_.current() && !atlas_.map(i).keyframes().empty()) order.push_back(i);
  }
  if (atlas_.num_maps() > 0) order.insert(order.begin(), atlas_.current());
  for (const std::size_t i : order) {
    View returned = view;
    PoseResult pose = frame_tracker_.Relocalise(i, returned);
    if (pose.num_inliers < options_.min_inliers) continue;
    atlas_.Use(i);
    pose = frame_tracker_.RefineByPatchAlignment(returned, pose);
    initialiser_ = MapInitialiser(options_.initialisation, options_.seed);
    return Continue(std::move(returned), pose);
  }
  return std::nullopt;
}

// Then the frames that came before get their poses after all: those between the two views, and
// those before the first, backwards, for which the map grows as it does forwards.
std::vector<FramePose> MonocularTracker::StartMap(const MapStart& start) {
  atlas_.StartMap(*camera_);
  num_adjusted_keyframes_ = 0;
  is_adjustment_left_ = false;
  Map& map = atlas_.map();
  FillMap(start, map);
  // On what a third image far away shows of both, the pairs of the start alone are few.
  if (MedianShift(start) > options_.initialisation.search_radius_share * camera_->width) {
    CreatePoints(map, 1, options_.mapping);
    CreatePointsByPatches(map, 1, options_.mapping);
  }
  for (const KeyframeId id : {0, 1}) atlas_.AddPlace(id);
  const View first = map.keyframe(0).view;
  frame_tracker_.SetReference(0);
  frame_tracker_.ExpectMotion(map.T_cam_world(1) * first.T_cam_world.Inverse(),
                              start.second.frame.timestamp_s - first.frame.timestamp_s);
  const std::size_t first_frame = atlas_.num_frames();
  frame_tracker_.Remember(first, 0);
  const std::vector<Frame> between = backlog_.Take(first.frame.index, start.second.frame.index);
  FrameTracker::State at_second = TrackBetween(between);
  if (!first.frame.sensor.shutter.IsGlobal()) {
    // The velocities of the two views are known only now.
    frame_tracker_.refiner().Refine();
    AdjustAll(map);
    atlas_.RemoveFramesFrom(first_frame + 1);
    frame_tracker_.refiner().ForgetFrom(first_frame + 1);
    at_second = TrackBetween(between);
  }
  std::vector<Frame> before = backlog_.Take(-1, first.frame.index);
  std::reverse(before.begin(), before.end());
  TrackBacklog(before, true);
  backlog_.Clear();
  // All of them are through with their adjustment: nothing older will come.
  for (KeyframeId id = 2; id < map.keyframes().size(); ++id) MarkAdjusted(map, id);
  atlas_.EndStart();
  atlas_.SetNewest(1);
  frame_tracker_.SetState(at_second);
  frame_tracker_.SetReference(1);
  is_publication_due_ = true;
  return atlas_.FramePosesFrom(first_frame);
}

// The frames between the two views of a start: returns where tracking stands at the second.
FrameTracker::State MonocularTracker::TrackBetween(const std::vector<Frame>& frames) {
  const FrameTracker::State at_first = frame_tracker_.state();
  TrackBacklog(frames, false);
  frame_tracker_.AddMotionTo(1);
  const FrameTracker::State at_second = frame_tracker_.state();
  frame_tracker_.SetState(at_first);
  return at_second;
}

TrackingResult MonocularTracker::Follow(View view) {
  const PoseResult pose = frame_tracker_.FindPose(view);
  if (pose.num_inliers < options_.min_inliers) {
    return Lose(view, NeededText(pose.num_inliers, "map points found again", options_.min_inliers));
  }
  return Continue(std::move(view), pose);
}

TrackingResult MonocularTracker::Continue(View view, const PoseResult& pose) {
  frame_tracker_.UpdateMotion(view);
  const bool was_lost = frame_tracker_.lost_since_s().has_value() || backlog_.size() > 0;
  frame_tracker_.SetFound();

  TrackingResult result;
  result.status = TrackingStatus::kTracking;
  result.num_inliers = pose.num_inliers;
  result.reprojection_px = pose.reprojection_px;
  result.is_keyframe = InsertIfNeeded(view, pose);
  if (result.is_keyframe && mapping_) {
    mapping_->Add(atlas_.newest());
  } else if (result.is_keyframe) {
    MappingLock alone;
    MapKeyframe(atlas_.newest(), alone);
    if (!turn_.IsPending()) result.finalised_keyframes = HandOver();
    frame_tracker_.refiner().Refine();
  }
  if (result.is_keyframe) view = atlas_.map().keyframe(atlas_.newest()).view;
  result.map_id = atlas_.map().id();  // another one where two were joined
  result.T_world_cam = view.T_cam_world.Inverse();
  frame_tracker_.Remember(std::move(view), NewestIf(result.is_keyframe));
  result.pose = atlas_.frame_pose(atlas_.num_frames() - 1);
  if (was_lost) result.recovered = TrackLostFrames();
  return result;
}

TrackingResult MonocularTracker::Lose(const View& view, const std::string& reason) {
  frame_tracker_.SetLost(view.frame.timestamp_s);
  const bool is_over =
      view.frame.timestamp_s - *frame_tracker_.lost_since_s() >= options_.recovery_s;
  // A map that is left is complete: what is mapped in the background is of the map in use.
  if (is_over && mapping_) mapping_->Wait(*lock_);
  TrackingResult result;
  result.status = TrackingStatus::kLost;
  result.loss = TrackingLoss::kTooFewMapPoints;
  result.reason = reason;
  result.map_id = atlas_.map().id();
  if (is_over) turn_.Abandon();
  if (is_over && !turn_.IsRefused()) {
    result.finalised_keyframes = HandOverAll(mapping_ != nullptr);
    frame_tracker_.refiner().Finish();
    result.reason += "; starting anew";
    atlas_.Leave();
    frame_tracker_.Reset();
  }
  return result;
}

// Tracks frames left without a pose, each from the one before in the list, the first from the last
// tracked view. `may_insert`: new keyframes where they are needed.
void MonocularTracker::TrackBacklog(const std::vector<Frame>& frames, bool may_insert) {
  constexpr int kMaxFailures = 5;  // in a row; beyond, the camera was elsewhere
  int num_failures = 0;
  for (const Frame& frame : frames) {
    if (num_failures > kMaxFailures) break;
    View view = frame_tracker_.MakeView(frame);
    const PoseResult pose = frame_tracker_.FindPose(view);
    ++num_failures;
    if (pose.num_inliers < options_.min_inliers) continue;
    num_failures = 0;
    frame_tracker_.UpdateMotion(view);
    const bool is_keyframe = may_insert && InsertIfNeeded(view, pose);
    if (is_keyframe) {
      MappingLock alone;
      local_mapper_.MapKnownDepths(atlas_.map(), atlas_.newest(), alone);
      atlas_.AddPlace(atlas_.newest());
      view = atlas_.map().keyframe(atlas_.newest()).view;
    }
    frame_tracker_.Remember(std::move(view), NewestIf(is_keyframe));
  }
}

// The frames of a loss, backwards from where the track was found again.
std::vector<FramePose> MonocularTracker::TrackLostFrames() {
  const std::size_t first_frame = atlas_.num_frames();
  std::vector<Frame> lost = backlog_.Take(-1, frame_tracker_.state().previous->frame.index);
  std::reverse(lost.begin(), lost.end());
  const FrameTracker::State found = frame_tracker_.state();
  TrackBacklog(lost, false);
  frame_tracker_.SetState(found);
  std::vector<FramePose> tracked = atlas_.FramePosesFrom(first_frame);
  std::reverse(tracked.begin(), tracked.end());
  return tracked;
}

// The new keyframe, which has yet to be mapped, is the newest and the reference.
bool MonocularTracker::InsertIfNeeded(View& view, const PoseResult& pose) {
  if (!NeedsKeyframe(frame_tracker_.EvidenceFor(view, pose), options_.insertion)) return false;
  frame_tracker_.AddFeatures(view);
  frame_tracker_.SetReference(atlas_.AddKeyframe(view));
  is_publication_due_ = true;
  return true;
}

void MonocularTracker::MapKeyframe(KeyframeId keyframe, MappingLock& lock) {
  local_mapper_.MapKeyframe(atlas_.map(), keyframe, lock);
  SettleYoungMap(keyframe, lock);
  const double scale_before = atlas_.map().keyframe(keyframe).scale;
  {
    const ScopedStageTimer timer(times_, "tracking/turn_on_the_spot");
    turn_.Follow(atlas_.map(), keyframe, frame_tracker_.refiner(), lock);
  }
  frame_tracker_.Rescale(atlas_.map().keyframe(keyframe).scale / scale_before);
  if (lock.IsShared()) PublishPoses();
  lock.Yield();
  const bool is_closed = ClosePlaces(keyframe, lock);
  bool has_followed = FollowModel(lock);
  if (is_closed || has_followed) positions_.SetDue(atlas_.map().id());
  has_followed = FollowNewPositions(atlas_.current(), true, lock) || has_followed;
  if (lock.IsShared() && (is_closed || has_followed)) PublishPoses();
}

// With a rolling shutter a start bends its map: each time that a young one has doubled, it is
// settled.
void MonocularTracker::SettleYoungMap(KeyframeId keyframe, MappingLock& lock) {
  const Map& map = atlas_.map();
  if (!HasRollingShutter(map)) return;
  const std::size_t count = map.keyframes().size();
  if (count != kYoung / 4 && count != kYoung / 2 && count != kYoung) return;
  const double scale_before = map.keyframe(keyframe).scale;
  Settle(lock);
  frame_tracker_.Rescale(map.keyframe(keyframe).scale / scale_before);
}

// All velocities are found again by the poses as they are now, and all is adjusted to them. Twice:
// the first adjustment moves the poses by more than they are known to.
void MonocularTracker::Settle(MappingLock& lock) {
  const ScopedStageTimer timer(times_, "tracking/full_bundle_adjustment");
  for (int i = 0; i < 2; ++i) {
    frame_tracker_.refiner().RefineAll(lock);
    AdjustAllAndScales(atlas_.map(), lock);
  }
}

// Keyframes that are final. None of a map that has yet to settle: its first ones may be half a
// degree off and were taken apart by wrong velocities, and a depth map of such images is wrong by
// percents, which poses that come later do not mend.
std::vector<Keyframe> MonocularTracker::HandOver() {
  Map& map = atlas_.map();
  if (HasRollingShutter(map) && !HasSettled(map)) return {};
  return TakeFinalised(map, false);
}

// Every keyframe left. Nothing else works on the map. With a rolling shutter the whole map is
// settled before: keyframes that were adjusted with some newer ones alone still have velocities by
// poses that are bent, and poses bent by these. Not for that alone where frames are waiting.
std::vector<Keyframe> MonocularTracker::HandOverAll(bool are_frames_waiting) {
  Map& map = atlas_.map();
  const bool settles =
      HasRollingShutter(map) &&
      (!HasSettled(map) || (!are_frames_waiting && frame_tracker_.refiner().HoldsWholeMap()));
  if (settles) {
    MappingLock alone;
    Settle(alone);
    PublishPoses();
  }
  return TakeFinalised(map, true);
}

// A new keyframe may show what an old one of its map has seen, or what another map holds. True
// when the map has moved.
bool MonocularTracker::ClosePlaces(KeyframeId keyframe, MappingLock& lock) {
  const std::optional<PlaceClosure> closure = loop_closer_.Close(keyframe, lock);
  if (!closure) return false;
  if (closure->shift) {
    frame_tracker_.Renumber(*closure->shift);
    turn_.Renumber(*closure->shift);
    if (mapping_) mapping_->Renumber(closure->shift->keyframes);
  }
  frame_tracker_.Rescale(closure->scale);
  RequestAdjustment(lock);
  return true;
}

// True when the map has moved, to where the model has some of its keyframes. The pose graph alone
// moves it where the map has not grown by a quarter since it was adjusted for that: on a long
// flight the model speaks every few seconds, and all adjustments together must not cost more than a
// few of the last one. What is left to adjust is so at the end.
bool MonocularTracker::FollowModel(MappingLock& lock) {
  constexpr double kGrowth = 1.25;
  const KeyframeId newest = atlas_.newest();  // another one may come while the map is given up
  const double scale_before = atlas_.map().keyframe(newest).scale;
  const auto num_keyframes = static_cast<std::int64_t>(atlas_.map().keyframes().size());
  const bool is_due =
      static_cast<double>(num_keyframes) >= kGrowth * static_cast<double>(num_adjusted_keyframes_);
  {
    const ScopedStageTimer timer(times_, "tracking/constraints");
    if (!FollowConstraints(atlas_.map(), lock, is_due)) return false;
  }
  frame_tracker_.Rescale(atlas_.map().keyframe(newest).scale / scale_before);
  is_adjustment_left_ = !is_due;
  if (is_due) {
    num_adjusted_keyframes_ = num_keyframes;
    RequestAdjustment(lock);
  }
  return true;
}

void MonocularTracker::AdjustWhatIsLeft(MappingLock& alone) {
  if (!std::exchange(is_adjustment_left_, false)) return;
  const ScopedStageTimer timer(times_, "tracking/full_bundle_adjustment");
  Map& map = atlas_.map();
  const double scale_before = atlas_.IsInUse() ? map.keyframe(atlas_.newest()).scale : 1;
  num_adjusted_keyframes_ = static_cast<std::int64_t>(map.keyframes().size());
  AdjustAllAndScales(map, alone);
  if (atlas_.IsInUse()) {
    frame_tracker_.Rescale(map.keyframe(atlas_.newest()).scale / scale_before);
  }
}

// True when the map has moved, to where positions have it. A turn on the spot may be taken back
// with all that came after it, and has to be judged first.
bool MonocularTracker::FollowNewPositions(std::size_t index, bool is_growing, MappingLock& lock) {
  if (turn_.IsPending()) return false;
  Map& map = atlas_.map(index);
  if (!positions_.Has(map.id())) return false;
  const ScopedStageTimer timer(times_, "tracking/positions");
  const auto frames_of_map = [&] {
    std::vector<TrajectoryEntry> frames = atlas_.Trajectory();
    std::erase_if(frames, [&](const TrajectoryEntry& entry) { return entry.map_id != map.id(); });
    return frames;
  };
  const KeyframeId newest = atlas_.newest();
  const double scale_before = atlas_.map().keyframe(newest).scale;
  // Local adjustments reach so far back from the newest keyframe.
  const auto num_open = static_cast<std::size_t>(options_.mapping.num_adjusted_keyframes +
                                                 options_.mapping.num_fixed_keyframes);
  const bool has_moved =
      is_growing && lock.IsShared()
          ? positions_.FollowInBackground(map, frames_of_map, num_open)
          : positions_.Follow(map, frames_of_map, is_growing ? num_open : 0, lock);
  if (has_moved) frame_tracker_.Rescale(atlas_.map().keyframe(newest).scale / scale_before);
  return has_moved;
}

// Who does not share the map has adjusted it at once.
void MonocularTracker::RequestAdjustment(const MappingLock& lock) {
  if (mapping_ && lock.IsShared()) mapping_->RequestAdjustment();
}

// Both work on the map in use: it is left only when all of it is mapped.
MappingWork MonocularTracker::BackgroundWork() {
  const auto map_keyframe = [this](KeyframeId keyframe, MappingLock& lock) {
    MapKeyframe(keyframe, lock);
  };
  const auto adjust_all = [this](MappingLock& lock) {
    const ScopedStageTimer timer(times_, "tracking/full_bundle_adjustment");
    const bool is_done = AdjustAllAndScales(atlas_.map(), lock);
    positions_.SetDue(atlas_.map().id());
    if (is_done) (void)FollowNewPositions(atlas_.current(), true, lock);
    PublishPoses();
    return is_done;
  };
  return {map_keyframe, adjust_all};
}

std::unique_ptr<TrackingLock> MonocularTracker::Lock() const {
  return mapping_ ? std::make_unique<TrackingLock>(mapping_->mutex()) : nullptr;
}

void MonocularTracker::PublishPoses() {
  atlas_.PublishPoses();
  is_publication_due_ = false;
}

void MonocularTracker::Constrain(std::span<const KeyframeConstraint> constraints) {
  if (!options_.with_constraints) return;
  const std::unique_ptr<TrackingLock> lock = Lock();
  for (const KeyframeConstraint& constraint : constraints) {
    for (std::size_t i = 0; i < atlas_.num_maps(); ++i) {
      if (AddConstraint(atlas_.map(i), constraint)) break;
    }
  }
}

void MonocularTracker::WaitForMapping() {
  const std::unique_ptr<TrackingLock> lock = Lock();
  if (mapping_) mapping_->Wait(*lock);
  MappingLock alone;  // nothing is mapped now
  bool has_moved = atlas_.IsInUse() && FollowModel(alone);
  has_moved = has_moved || is_adjustment_left_;
  AdjustWhatIsLeft(alone);
  if (has_moved) positions_.SetDue(atlas_.map().id());
  for (std::size_t i = 0; i < atlas_.num_maps(); ++i) {
    has_moved = FollowNewPositions(i, false, alone) || has_moved;
  }
  if (has_moved) PublishPoses();
}

void MonocularTracker::FollowPositions(const CameraPositions& positions) {
  const std::unique_ptr<TrackingLock> lock = Lock();
  positions_.Set(positions);
}

std::vector<PositionFit> MonocularTracker::PositionFits() const {
  const std::unique_ptr<TrackingLock> lock = Lock();
  return positions_.Fits();
}

std::vector<Keyframe> MonocularTracker::Finish() {
  const std::unique_ptr<TrackingLock> lock = Lock();
  if (mapping_) mapping_->Wait(*lock);
  lock_ = lock.get();
  std::vector<Keyframe> finalised;
  while (turn_.IsPending()) {
    MappingLock alone;
    turn_.Judge(atlas_.map(), frame_tracker_.refiner(), alone);
    if (turn_.IsRefused()) Append(UndoTurn({}).finalised_keyframes, finalised);
    if (mapping_) mapping_->Wait(*lock);
  }
  if (!atlas_.IsInUse()) return finalised;
  Append(HandOverAll(false), finalised);
  frame_tracker_.refiner().Finish();
  return finalised;
}

std::vector<TrajectoryEntry> MonocularTracker::Trajectory() const {
  const std::unique_ptr<TrackingLock> lock = Lock();
  return atlas_.Trajectory();
}

std::vector<TrajectoryEntry> MonocularTracker::KeyframeTrajectory() const {
  const std::unique_ptr<TrackingLock> lock = Lock();
  return atlas_.KeyframeTrajectory();
}

SparseModel MonocularTracker::Sparse(int map_id) const {
  const std::unique_ptr<TrackingLock> lock = Lock();
  return atlas_.Sparse(map_id);
}

std::string MonocularTracker::SaveMap() const {
  const std::unique_ptr<TrackingLock> lock = Lock();
  return atlas_.Save();
}

void MonocularTracker::LoadMap(std::string_view bytes, const std::string& where) {
  const std::unique_ptr<TrackingLock> lock = Lock();
  if (camera_) throw UsageError("a map must be loaded before the first frame");
  atlas_.Load(bytes, where);
  camera_ = atlas_.map().camera();
}

// All members that outlast a frame. In the order in which they lean on each other.
template <typename Archive>
void MonocularTracker::ExchangeState(Archive& archive) {
  ExchangeOptions(archive, ListOptions(options_), "tracking.");
  archive.Optional(camera_, [&](CameraModel& camera) { mono3d::ExchangeState(archive, camera); });
  atlas_.ExchangeState(archive);
  frame_tracker_.ExchangeState(archive);
  initialiser_.ExchangeState(archive, camera_.value_or(CameraModel()),
                             options_.features.num_levels);
  backlog_.ExchangeState(archive);
  archive.Number(is_publication_due_);
  ExchangeCount(archive, num_adjusted_keyframes_);
  archive.Number(is_adjustment_left_);
  turn_.ExchangeState(archive, atlas_);
  positions_.ExchangeState(archive);
  if (mapping_) mapping_->ExchangeState(archive);
}

std::string MonocularTracker::SaveState(SavedImages images) const {
  const std::unique_ptr<TrackingLock> lock = Lock();
  if (mapping_) mapping_->Pause(*lock);
  // It grows by a little from one to the next.
  StateWriter writer(kTrackerState, kTrackerStateVersion, images,
                     last_state_bytes_ + last_state_bytes_ / 16);
  const_cast<MonocularTracker&>(*this).ExchangeState(writer);  // a writer changes nothing
  if (mapping_) mapping_->Resume();
  std::string state = writer.TakeState();
  last_state_bytes_ = state.size();
  return state;
}

void MonocularTracker::RestoreState(std::string_view bytes, const std::string& where,
                                    const ImageOfFrame& images) {
  const std::unique_ptr<TrackingLock> lock = Lock();
  if (camera_) throw UsageError("a state must be restored before the first frame");
  if (mapping_) mapping_->Pause(*lock);
  StateReader reader(bytes, kTrackerState, kTrackerStateVersion, where, images);
  ExchangeState(reader);
  reader.CheckEnd();
  if (!IsConsistent()) reader.Refuse("contradicts itself");
  if (mapping_) mapping_->Resume();
}

// One camera, and keyframes that are there.
bool MonocularTracker::IsConsistent() const {
  const auto is_of_camera = [&](const Frame& frame) { return frame.camera == *camera_; };
  if (!camera_) {
    return atlas_.num_maps() == 0 && backlog_.size() == 0 && turn_.frames().size() == 0;
  }
  for (std::size_t i = 0; i < atlas_.num_maps(); ++i) {
    if (!(atlas_.map(i).camera() == *camera_)) return false;
  }
  return std::ranges::all_of(backlog_.frames(), is_of_camera) &&
         std::ranges::all_of(turn_.frames().frames(), is_of_camera) &&
         (!mapping_ || std::ranges::all_of(mapping_->waiting(), [&](KeyframeId id) {
           return atlas_.IsInUse() && IsKeyframeOf(atlas_.map(), id);
         }));
}

}  // namespace mono3d::tracking
