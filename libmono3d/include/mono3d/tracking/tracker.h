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

#include "mono3d/core/export.h"
#include "mono3d/core/options.h"
#include "mono3d/core/timing.h"
#include "mono3d/geometry/pose.h"
#include "mono3d/image/camera_positions.h"
#include "mono3d/image/frame.h"
#include "mono3d/image/frame_images.h"
#include "mono3d/image/keyframe.h"
#include "mono3d/image/keyframe_constraint.h"
#include "mono3d/image/keyframe_poses.h"
#include "mono3d/image/sparse_model.h"

namespace MONO3D_EXPORT mono3d {

enum class TrackingStatus { kNotInitialised, kTracking, kLost };

const char* ToString(TrackingStatus status);

// Why a frame has no pose.
enum class TrackingLoss {
  kTooFewFeatures,  // the image shows too little structure
  kNoStart,         // no two views make a map yet: parallax, matches, or a clear motion are missing
  kTooFewMapPoints,  // too little of the map is found in the image
  kOther,            // said in words alone
};

// What became of one frame.
struct TrackingResult {
  TrackingStatus status = TrackingStatus::kNotInitialised;
  TrackingLoss loss = TrackingLoss::kOther;  // where there is no pose
  std::string reason;  // why there is no pose: "62 matches, 100 needed"; empty while tracking
  // Counts the starts; poses of different maps have nothing in common. When the camera sees what
  // another map holds, its own goes into that one, and the number of its own is no more.
  int map_id = 0;
  // The frame is looked at with all others, in Finish; LateResults say what became of it.
  bool is_pending = false;
  std::optional<FramePose> pose;    // of this frame
  std::optional<Pose> T_world_cam;  // the same in the world of its map, as known now
  bool is_keyframe = false;
  int num_inliers = 0;         // map points that the pose rests on
  double reprojection_px = 0;  // root mean square over the inliers
  // Frames that came before without a pose and have one now: those before a start, tracked
  // backwards, and those of a loss, once the track is found again. Of map `map_id`.
  std::vector<FramePose> recovered;
  // Frames that came before and have a better pose now: the map around them has settled. Those of
  // the last keyframes become better with Finish: Trajectory has them.
  std::vector<FramePose> refined;
  // Keyframes that are final since the last call: their poses have been through local bundle
  // adjustment and will hardly move any more. In the order of flight. With a rolling shutter those
  // of a new map come together, once it has about 25, or with Finish.
  std::vector<Keyframe> finalised_keyframes;
};

// What became of a frame that was pending.
struct LateResult {
  std::int64_t frame_index = 0;
  std::optional<FramePose> pose;
  std::string reason;  // why there is none
};

// Camera poses from a video, frame by frame (paper, section 3.1). The scale of each map is free:
// its first median depth is 1 su. Calls come from one thread at a time, but for Poses.
class Tracker {
 public:
  virtual ~Tracker() = default;

  // Frames come in the order of time. A frame that cannot be tracked is a status, not an error.
  // Throws Error on an invalid frame, or one whose camera differs from the first frame's.
  [[nodiscard]] virtual TrackingResult Track(const Frame& frame) = 0;

  // Model-to-tracker constraints: measured poses of keyframes that were handed out, relative to
  // each other. One that agrees with the map (chi2) is kept and holds in all adjustments that
  // follow. For one that does not, the keyframes of the map move, with its next keyframe or in
  // WaitForMapping, where they can agree with it within the drift of a tracker; else it is
  // discarded, as it is when the keyframes are of different maps. A tracker may ignore all
  // constraints.
  virtual void Constrain(std::span<const KeyframeConstraint> /*constraints*/) {}

  // Measured camera positions of one map, all that there are so far. With the next keyframe of the
  // map, or in WaitForMapping, its keyframes move to where they agree with the positions as far as
  // those are better known than how the path has drifted; and again after each adjustment of all of
  // it. The frame and unit of the map hold where it began. A tracker may ignore positions.
  virtual void FollowPositions(const CameraPositions& /*positions*/) {}
  // What has become of them, the latest of each map.
  virtual std::vector<PositionFit> PositionFits() const { return {}; }

  // The latest poses of all keyframes that were handed out or that a FramePose names. When
  // keyframes have come or moved, there is a new snapshot at the latest when Track, WaitForMapping
  // or Finish returns; live also in between. Never null. From any thread, at any time: it only
  // copies a pointer under a lock.
  virtual KeyframePosesPtr Poses() const = 0;

  // Returns when all keyframes are mapped, live by the mapping thread, and the map has moved as its
  // constraints ask.
  virtual void WaitForMapping() {}

  // No more frames will come: returns the keyframes that were not final yet. After
  // WaitForMapping, or what it changes may be missed.
  [[nodiscard]] virtual std::vector<Keyframe> Finish() = 0;

  // After Finish: of all frames that were pending.
  virtual std::vector<LateResult> LateResults() const { return {}; }

  // Keyframes that were finalised so far but could not be handed out, as their images were no
  // longer kept.
  virtual std::int64_t num_keyframes_without_image() const { return 0; }

  // Every tracked frame by the final poses of its keyframes, in the order of flight.
  virtual std::vector<TrajectoryEntry> Trajectory() const = 0;
  // The keyframes alone.
  virtual std::vector<TrajectoryEntry> KeyframeTrajectory() const = 0;
  // The keyframes of one map, its points and where they show; empty where the tracker has none.
  virtual SparseModel Sparse(int map_id) const;

  // The map with most tracked frames, so that another tracker can go on in it, later and on new
  // footage of the same camera. Throws Error when there is no map.
  virtual std::string SaveMap() const;
  // Before the first frame: takes over what SaveMap returned; `where` names the bytes in messages.
  // Tracking begins with finding the first frames in that map, whose frame, scale and id, 0 from
  // now on, hold. Where the footage goes on with that of the map (later in index and time), the
  // trajectories have both. Throws Error on anything that SaveMap has not made, UsageError after
  // the first frame or under other options of the image pyramid. A tracker need not support either.
  virtual void LoadMap(std::string_view bytes, const std::string& where);

  // All that the tracker knows, so that a run which was broken off goes on. Between two calls of
  // Track, or after WaitForMapping; live it waits until the keyframe that is being mapped is
  // mapped, not for those behind it. A sequence of sections, most of which the state of a moment
  // later has as well: see core/state_sections.h. Throws Error where a tracker cannot.
  virtual std::string SaveState(SavedImages images = SavedImages::kIncluded) const;
  // Before the first frame, by a tracker made with the same options: takes over what SaveState has
  // returned; `where` names the bytes in messages. With the next frames the tracker goes on as that
  // one would have: in sequential mode every result is the same to the bit. `images` gives the
  // images of a state that was saved without them: of frames that have no pose yet, and of those of
  // the latest keyframes. Throws UsageError after the first frame, under other options and without
  // the images it needs, Error on anything that SaveState has not made; after either the tracker
  // must not be used any more.
  virtual void RestoreState(std::string_view bytes, const std::string& where,
                            const ImageOfFrame& images = {});
};

struct FeatureOptions {
  int num_features = 1000;  // twice as many while there is no map
  int num_levels = 8;
  double scale_factor = 1.2;
  int fast_threshold = 20;     // grey values
  int min_fast_threshold = 7;  // in cells where the first finds nothing
  // Standard deviation of where the patch of a map point is found, besides the noise of the image,
  // px of the octave that it is found on: by the bilinear interpolation, surfaces that are no
  // planes, a calibration that is nearly right. Whoever tracks with a calibration that may be wrong
  // states more: else what contradicts the calibration is an outlier.
  double patch_sigma_px = 0.07;

  void Visit(OptionVisitor& visit);
};

// The start from two views (Mur-Artal, Montiel, Tardos 2015, section IV).
struct InitialisationOptions {
  int min_matches = 100;
  int min_points = 50;
  double min_parallax_deg = 1;
  double search_radius_share = 0.13;  // of the image width: 100 px of 768
  double max_wait_s = 60;             // the first view is given up after this time
  double max_kept_mb = 128;           // images without a pose that are kept for a pose later

  void Visit(OptionVisitor& visit);
};

// When a frame becomes a keyframe: by content. The two limits keep five neighbours usable as one
// bundle of the depth stage.
struct KeyframeInsertionOptions {
  double max_rotation_deg = 4;       // between neighbours
  double max_baseline_share = 0.07;  // of the median depth, between neighbours
  double min_baseline_share = 0.02;  // closer ones only where tracking needs them
  double min_tracked_share = 0.9;    // of the points of the reference keyframe
  int min_inliers = 15;

  void Visit(OptionVisitor& visit);
};

struct LocalMappingOptions {
  int num_neighbours = 4;            // keyframes that new points are triangulated with
  double min_baseline_share = 0.01;  // of the median depth, for triangulation
  int num_adjusted_keyframes = 10;   // in a local bundle adjustment, at most
  int num_fixed_keyframes = 5;       // further ones that see the same points
  double max_redundant_share = 0.9;  // of a keyframe's points seen by three others: culled

  void Visit(OptionVisitor& visit);
};

struct TrackerOptions {
  // "sequential": Track maps a new keyframe before it returns; same input, same result. "live": a
  // thread of its own maps, adjusts and closes loops; Track waits only while more than two
  // keyframes lie before that, so a frame takes no longer than its tracking.
  std::string mode = "sequential";
  // Larger images are tracked on smaller ones with a longer side of so many pixels; poses,
  // keyframes and sparse points are those of the images given. A quarter of 3840, half of 1920:
  // corners and search ranges are made for images of about that size.
  int max_side_px = 960;
  FeatureOptions features;
  InitialisationOptions initialisation;
  KeyframeInsertionOptions insertion;
  LocalMappingOptions mapping;
  // Model-to-tracker constraints (Tracker::Constrain) may move the map.
  bool with_constraints = true;
  int min_inliers = 30;   // map points a pose must rest on
  double recovery_s = 1;  // how long a lost pose is searched for before a new map starts
  int seed = 1;           // of RANSAC

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

// The tracker of the ORB-SLAM2 class. `times`, where given, must outlive it.
std::unique_ptr<Tracker> CreateTracker(const TrackerOptions& options = {},
                                       StageTimes* times = nullptr);

}  // namespace mono3d
