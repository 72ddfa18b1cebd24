// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The part of OrbTracker that is about its maps: how one starts, grows over frames that came
// before, is found again, and becomes one with another.

#include <algorithm>
#include <utility>

#include "mono3d/image/keyframe.h"
#include "tracking/map/keyframe_handover.h"
#include "tracking/mapping/point_creation.h"
#include "tracking/optimisation/constraint_following.h"
#include "tracking/optimisation/map_constraints.h"
#include "tracking/optimisation/view_pose.h"
#include "tracking/orb_tracker.h"
#include "tracking/places/loop_closing.h"
#include "tracking/places/map_joining.h"
#include "tracking/start/map_start.h"

namespace mono3d::tracking {
namespace {

// By how much the points of a start move from its first image to the second: the median, in px.
double ImageMotion(const MapStart& start) {
  std::vector<float> lengths;
  for (const FeatureMatch& match : start.motion.matches) {
    lengths.push_back(static_cast<float>(
        (start.second.features[match.feature_b].pixel - start.first.features[match.feature_a].pixel)
            .norm()));
  }
  return Median(std::move(lengths));
}

}  // namespace

// Then the frames that came before get their poses after all: those between the two views, and
// those before the first, backwards, for which the map grows as it does forwards.
std::vector<FramePose> OrbTracker::StartMap(const MapStart& start) {
  current_ = maps_.size();
  maps_.push_back(
      std::make_unique<Map>(static_cast<int>(maps_.size()), *camera_, options_.features));
  FillMap(start, map());
  // On what a third image far away shows of both, the pairs of the start alone are few.
  if (ImageMotion(start) > options_.initialisation.search_radius_share * camera_->width) {
    CreatePoints(map(), 1, options_.mapping);
    CreatePointsByPatches(map(), 1, options_.mapping);
  }
  places_.emplace_back();
  for (const KeyframeId id : {0, 1})
    places_[current_].Add(id, FeaturesWithPoints(map().keyframe(id).view));
  has_map_ = true;
  reference_ = 0;
  newest_ = 0;
  const View first = map().keyframe(0).view;
  velocity_ = map().T_cam_world(1) * first.T_cam_world.Inverse();
  velocity_duration_s_ = start.second.frame.timestamp_s - first.frame.timestamp_s;
  const std::size_t first_record = records_.size();
  Remember(first);
  TrackBacklog(backlog_.Take(first.frame.index, start.second.frame.index), false);
  std::vector<Frame> before = backlog_.Take(-1, first.frame.index);
  std::reverse(before.begin(), before.end());
  TrackBacklog(before, true);
  backlog_.Clear();
  for (const KeyframeId id : map().InOrderOfFlight()) map().keyframe(id).id = next_keyframe_id_++;
  is_publication_due_ = true;
  // All of them are through with their adjustment: nothing older will come.
  for (KeyframeId id = 2; id < map().keyframes().size(); ++id) MarkAdjusted(map(), id);
  newest_ = 1;
  reference_ = 1;
  return RememberedSince(first_record);
}

// Tracks frames left without a pose, each from the one before in the list, the first from the last
// tracked view, to which it then returns. `may_insert`: new keyframes where they are needed.
void OrbTracker::TrackBacklog(const std::vector<Frame>& frames, bool may_insert) {
  constexpr int kMaxFailures = 5;  // in a row; beyond, the camera was elsewhere
  const std::optional<View> from = previous_;
  const std::size_t from_record = previous_record_;
  const KeyframeId from_reference = reference_;
  const std::optional<Pose> from_velocity = velocity_;
  const double from_duration_s = velocity_duration_s_;
  int num_failures = 0;
  for (const Frame& frame : frames) {
    if (num_failures > kMaxFailures) break;
    View view = MakeView(frame);
    const PoseResult pose = FindPose(view);
    ++num_failures;
    if (pose.num_inliers < options_.min_inliers) continue;
    num_failures = 0;
    UpdateMotion(view);
    if (may_insert && InsertIfNeeded(view, pose, MapWhen::kNow)) {
      places_[current_].Add(newest_, FeaturesWithPoints(map().keyframe(newest_).view));
      view = map().keyframe(newest_).view;
    }
    Remember(std::move(view));
  }
  previous_ = from;
  previous_record_ = from_record;
  reference_ = from_reference;
  velocity_ = from_velocity;
  velocity_duration_s_ = from_duration_s;
}

// The frames of a loss, backwards from where the track was found again.
std::vector<FramePose> OrbTracker::TrackLostFrames() {
  const std::size_t first_record = records_.size();
  std::vector<Frame> lost = backlog_.Take(-1, previous_->frame.index);
  std::reverse(lost.begin(), lost.end());
  TrackBacklog(lost, false);
  std::vector<FramePose> tracked = RememberedSince(first_record);
  std::reverse(tracked.begin(), tracked.end());
  return tracked;
}

// While no new map has started, one of the known ones may come into view again, most likely the
// last one.
std::optional<TrackingResult> OrbTracker::Return(View& view) {
  std::vector<std::size_t> order;
  for (std::size_t i = maps_.size(); i-- > 0;) {
    if (i != current_ && !maps_[i]->keyframes().empty()) order.push_back(i);
  }
  if (!maps_.empty()) order.insert(order.begin(), current_);
  for (const std::size_t i : order) {
    View returned = view;
    current_ = i;
    PoseResult pose = Recover(returned);
    if (pose.num_inliers < options_.min_inliers) continue;
    pose = RefineByPatchAlignment(returned, pose);
    has_map_ = true;
    newest_ = map().keyframes().size() - 1;
    while (!map().keyframe(newest_).alive) --newest_;
    initialiser_ = MapInitialiser(options_.initialisation, options_.seed);
    return Continue(std::move(returned), pose);
  }
  if (!order.empty()) current_ = order.front();
  return std::nullopt;
}

// A new keyframe may show what an old one of its map has seen, or what another map holds. True
// when the map has moved.
bool OrbTracker::RecognisePlace(KeyframeId keyframe, MappingLock& lock) {
  const double scale_before = map().keyframe(keyframe).scale;
  if (!CloseLoopIfAny(keyframe, lock)) {
    const std::optional<KeyframeId> added = JoinIfKnown(keyframe, lock);
    if (!added) return false;
    keyframe += *added;
  }
  RescaleMotion(map().keyframe(keyframe).scale / scale_before);
  return true;
}

void OrbTracker::Constrain(std::span<const KeyframeConstraint> constraints) {
  if (!options_.with_constraints) return;
  const std::unique_ptr<TrackingLock> lock = Lock();
  for (const KeyframeConstraint& constraint : constraints) {
    for (const std::unique_ptr<Map>& of : maps_) {
      if (AddConstraint(*of, constraint)) break;
    }
  }
}

// True when the map has moved, to where the model has some of its keyframes.
bool OrbTracker::FollowModel(MappingLock& lock) {
  const KeyframeId newest = newest_;  // another one may come while the map is given up
  const double scale_before = map().keyframe(newest).scale;
  {
    const ScopedStageTimer timer(times_, "tracking/constraints");
    if (!FollowConstraints(map(), lock)) return false;
  }
  if (mapping_ && lock.IsShared()) mapping_->RequestAdjustment();
  RescaleMotion(map().keyframe(newest).scale / scale_before);
  return true;
}

void OrbTracker::RescaleMotion(double ratio) {
  if (velocity_) velocity_ = Pose(velocity_->rotation(), ratio * velocity_->translation());
}

bool OrbTracker::CloseLoopIfAny(KeyframeId keyframe, MappingLock& lock) {
  std::optional<PlaceFound> loop;
  {
    const ScopedStageTimer timer(times_, "tracking/place_recognition");
    loop = FindLoop(map(), places_[current_], keyframe, options_.seed);
    places_[current_].Add(keyframe, FeaturesWithPoints(map().keyframe(keyframe).view));
    for (KeyframeId id = 0; id < keyframe; ++id) {
      if (!map().keyframe(id).alive) places_[current_].Remove(id);
    }
  }
  if (!loop) return false;
  const ScopedStageTimer timer(times_, "tracking/loop_closing");
  CloseLoop(map(), *loop, options_.mapping, lock);
  if (mapping_) mapping_->RequestAdjustment();
  return true;
}

// The current map goes into the one that knows the place, whose world others may rely on already.
// By how much the numbers of its keyframes have grown; nothing where none knows it.
std::optional<KeyframeId> OrbTracker::JoinIfKnown(KeyframeId keyframe, MappingLock& lock) {
  for (std::size_t other = 0; other < maps_.size(); ++other) {
    if (other == current_ || maps_[other]->keyframes().empty()) continue;
    std::optional<PlaceFound> place;
    {
      const ScopedStageTimer timer(times_, "tracking/place_recognition");
      place = FindInOtherMap(map(), keyframe, *maps_[other], places_[other], options_.seed);
    }
    if (!place) continue;
    const ScopedStageTimer timer(times_, "tracking/map_joining");
    const KeyframeId first_keyframe = maps_[other]->keyframes().size();
    const PointId first_point = maps_[other]->points().size();
    JoinMaps(*maps_[other], places_[other], map(), *place, options_.mapping, lock);
    for (FrameRecord& record : records_) {
      if (record.map_id != map().id()) continue;
      record.map_id = maps_[other]->id();
      record.keyframe += first_keyframe;
    }
    if (previous_) {
      for (std::optional<PointId>& point : previous_->points) {
        if (point) *point += first_point;
      }
    }
    places_[current_] = PlaceIndex();
    current_ = other;
    newest_ += first_keyframe;
    reference_ += first_keyframe;
    if (mapping_) {
      mapping_->Renumber(first_keyframe);
      mapping_->RequestAdjustment();
    }
    return first_keyframe;
  }
  return std::nullopt;
}

}  // namespace mono3d::tracking
