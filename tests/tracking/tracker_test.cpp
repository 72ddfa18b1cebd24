// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/tracking/tracker.h"

#include <gmock/gmock.h>

#include <numbers>
#include <opencv2/core.hpp>

#include "mono3d/core/error.h"
#include "mono3d/core/statistics.h"
#include "mono3d/geometry/similarity.h"
#include "mono3d/image/keyframe.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr int kNumFrames = 30;

// Rendered once for all tests.
const Sequence& Village() {
  static const Sequence sequence = FlyOver(TexturedGround(true), kNumFrames);
  return sequence;
}
const Sequence& Meadow() {
  static const Sequence sequence = FlyOver(TexturedGround(false), kNumFrames);
  return sequence;
}

struct Tracked {
  std::vector<TrackingResult> results;
  std::vector<Keyframe> keyframes;
  std::vector<TrajectoryEntry> trajectory;
  std::vector<TrajectoryEntry> keyframe_trajectory;
  KeyframePosesPtr poses;
  SparseModel sparse;
};

Tracked TrackAll(const std::vector<Frame>& frames, const TrackerOptions& options = {}) {
  const std::unique_ptr<Tracker> tracker = CreateTracker(options);
  Tracked run;
  for (const Frame& frame : frames) {
    run.results.push_back(tracker->Track(frame));
    const auto& finalised = run.results.back().finalised_keyframes;
    run.keyframes.insert(run.keyframes.end(), finalised.begin(), finalised.end());
  }
  for (Keyframe& keyframe : tracker->Finish()) run.keyframes.push_back(std::move(keyframe));
  run.trajectory = tracker->Trajectory();
  run.keyframe_trajectory = tracker->KeyframeTrajectory();
  run.poses = tracker->Poses();
  run.sparse = tracker->Sparse(0);
  return run;
}

// Root mean square distance from the truth after alignment, over the flying height of 10.
double RelativeError(const std::vector<TrajectoryEntry>& trajectory, const Sequence& sequence) {
  std::vector<Eigen::Vector3d> found;
  std::vector<Eigen::Vector3d> truth;
  for (const TrajectoryEntry& entry : trajectory) {
    found.push_back(entry.T_world_cam.translation());
    truth.push_back(
        sequence.T_world_cam[static_cast<std::size_t>(entry.frame_index)].translation());
  }
  const Similarity fit = FitSimilarity(found, truth);
  double sum = 0;
  for (std::size_t i = 0; i < found.size(); ++i) sum += (fit * found[i] - truth[i]).squaredNorm();
  return std::sqrt(sum / static_cast<double>(found.size())) / 10;
}

// A fifth of a pixel at 345 px of focal length would be 0.06 %; corners of small, sharp pictures on
// integer pixels leave some times that.
constexpr double kMaxRelativeError = 0.005;

TEST(Tracker, FollowsAFlightOverHouses) {
  const Tracked run = TrackAll(Village().frames);
  EXPECT_EQ(run.trajectory.size(), Village().frames.size());
  for (const TrajectoryEntry& entry : run.trajectory) EXPECT_EQ(entry.map_id, 0);
  EXPECT_LT(RelativeError(run.trajectory, Village()), kMaxRelativeError);
  EXPECT_GT(run.sparse.points.size(), 300U);
}

TEST(Tracker, FollowsAFlightOverAPlane) {
  const Tracked run = TrackAll(Meadow().frames);
  EXPECT_EQ(run.trajectory.size(), Meadow().frames.size());
  for (const TrajectoryEntry& entry : run.trajectory) EXPECT_EQ(entry.map_id, 0);
  // Over a plane slope and motion trade off: the start from two close views is vaguer.
  EXPECT_LT(RelativeError(run.trajectory, Meadow()), 2 * kMaxRelativeError);
}

TEST(Tracker, GivesTheSameBitsTwice) {
  const std::vector<Frame> frames(Village().frames.begin(), Village().frames.begin() + 16);
  const Tracked first = TrackAll(frames);
  const Tracked second = TrackAll(frames);
  ASSERT_EQ(first.trajectory.size(), second.trajectory.size());
  for (std::size_t i = 0; i < first.trajectory.size(); ++i) {
    EXPECT_EQ(first.trajectory[i].T_world_cam.Matrix(), second.trajectory[i].T_world_cam.Matrix());
  }
  ASSERT_EQ(first.sparse.points.size(), second.sparse.points.size());
  for (std::size_t i = 0; i < first.sparse.points.size(); ++i) {
    EXPECT_EQ(first.sparse.points[i].p_world, second.sparse.points[i].p_world);
  }
}

TEST(Tracker, StartsWithMedianDepthOne) {
  const std::unique_ptr<Tracker> tracker = CreateTracker();
  for (const Frame& frame : Village().frames) {
    if (tracker->Track(frame).status == TrackingStatus::kTracking) break;
  }
  const std::vector<Keyframe> keyframes = tracker->Finish();
  ASSERT_EQ(keyframes.size(), 2U);
  EXPECT_NEAR(UpperMedianOrZero(keyframes[0].sparse_depths_su), 1,
              1e-3);  // but for outliers taken out since
}

TEST(Tracker, HandsOutEachKeyframeOnceFinalisedInOrder) {
  const Tracked run = TrackAll(Village().frames);
  ASSERT_EQ(run.keyframes.size(), run.keyframe_trajectory.size());
  ASSERT_GE(run.keyframes.size(), 8U);
  for (std::size_t i = 0; i < run.keyframes.size(); ++i) {
    const Keyframe& keyframe = run.keyframes[i];
    EXPECT_EQ(keyframe.id, static_cast<std::int64_t>(i));
    EXPECT_EQ(run.poses->At(keyframe.id).map_id, 0);
    EXPECT_NO_THROW(Validate(keyframe.frame));
    EXPECT_GT(keyframe.sparse_depths_su.size(), 50U);
    if (i < 2) continue;  // the start waits for its parallax
    const Pose step = run.poses->At(run.keyframes[i - 1].id).T_world_cam().Inverse() *
                      run.poses->At(keyframe.id).T_world_cam();
    const double share = step.translation().norm() / UpperMedianOrZero(keyframe.sparse_depths_su);
    EXPECT_LT(step.RotationAngle() * 180 / std::numbers::pi, 5);
    EXPECT_LT(share, 0.1);
  }
}

TEST(Tracker, FinalisesAKeyframeOnlyBehindTwoNewerOnes) {
  const std::unique_ptr<Tracker> tracker = CreateTracker();
  std::size_t num_keyframes = 1;  // the first of the start is none of the results
  std::size_t num_finalised = 0;
  for (const Frame& frame : Village().frames) {
    const TrackingResult result = tracker->Track(frame);
    num_keyframes += result.is_keyframe ? 1U : 0U;
    num_finalised += result.finalised_keyframes.size();
    if (num_finalised > 0) {
      EXPECT_GE(num_keyframes, num_finalised + 2);
    }
  }
  EXPECT_GT(num_finalised, 3U);
}

TEST(Tracker, SaysWhyItDoesNotStart) {
  const std::unique_ptr<Tracker> tracker = CreateTracker();
  const TrackingResult black = tracker->Track(BlackFrame(0));
  EXPECT_EQ(black.status, TrackingStatus::kNotInitialised);
  EXPECT_EQ(black.reason, "0 features, 100 needed");
  EXPECT_EQ(black.loss, TrackingLoss::kTooFewFeatures);
  EXPECT_FALSE(black.T_world_cam.has_value());
  Frame still = Village().frames[0];
  for (int i = 1; i < 4; ++i) {
    still.index = i;
    still.timestamp_s = 0.1 * i;
    const TrackingResult result = tracker->Track(still);
    EXPECT_EQ(result.status, TrackingStatus::kNotInitialised);
    if (i > 1) {
      EXPECT_THAT(result.reason, Not(IsEmpty()));
    }
  }
  EXPECT_THAT(tracker->Trajectory(), IsEmpty());
  EXPECT_THAT(tracker->Finish(), IsEmpty());
  EXPECT_THAT(tracker->Sparse(0).points, IsEmpty());
}

// A narrow search loses the first views before there is parallax enough.
TrackerOptions LateStart() {
  TrackerOptions options;
  options.initialisation.search_radius_share = 0.1;
  options.initialisation.min_parallax_deg = 3;
  return options;
}

TEST(Tracker, TracksTheFramesBeforeItsStartBackwards) {
  const Tracked run = TrackAll(Village().frames, LateStart());
  std::size_t num_recovered = 0;
  for (const TrackingResult& result : run.results) {
    for (const FramePose& pose : result.recovered) {
      EXPECT_FALSE(run.results[static_cast<std::size_t>(pose.frame_index)].T_world_cam);
      EXPECT_EQ(run.poses->At(pose.keyframe_id).map_id, result.map_id);
      ++num_recovered;
    }
  }
  EXPECT_GE(num_recovered, 3U);
  ASSERT_EQ(run.trajectory.size(), Village().frames.size());
  for (std::size_t i = 0; i < run.trajectory.size(); ++i) {
    EXPECT_EQ(run.trajectory[i].frame_index, static_cast<std::int64_t>(i));
  }
  EXPECT_LT(RelativeError(run.trajectory, Village()), kMaxRelativeError);
  for (std::size_t i = 1; i < run.keyframes.size(); ++i) {
    EXPECT_GT(run.keyframes[i].frame.index, run.keyframes[i - 1].frame.index);
    EXPECT_EQ(run.keyframes[i].id, static_cast<std::int64_t>(i));
  }
}

TEST(Tracker, KeepsNoImagesForLaterWhereItMayNot) {
  TrackerOptions options = LateStart();
  options.initialisation.max_kept_mb = 0;
  const Tracked run = TrackAll(Village().frames, options);
  EXPECT_LT(run.trajectory.size(), Village().frames.size());
  EXPECT_GT(run.trajectory.size(), 10U);
}

TEST(Tracker, FindsItsPoseAgainAfterAShortLoss) {
  std::vector<Frame> frames = Village().frames;
  for (const std::size_t i : {14U, 15U, 16U}) {
    frames[i].bgr = BlackFrame(static_cast<std::int64_t>(i)).bgr;
  }
  const Tracked run = TrackAll(frames);
  for (const std::size_t i : {14U, 15U, 16U}) {
    EXPECT_EQ(run.results[i].status, TrackingStatus::kLost);
    EXPECT_THAT(run.results[i].reason, HasSubstr("map points found again, 30 needed"));
    EXPECT_EQ(run.results[i].loss, TrackingLoss::kTooFewMapPoints);
    EXPECT_FALSE(run.results[i].T_world_cam.has_value());
  }
  EXPECT_EQ(run.results[17].status, TrackingStatus::kTracking);
  for (const TrajectoryEntry& entry : run.trajectory) EXPECT_EQ(entry.map_id, 0);
  EXPECT_LT(RelativeError(run.trajectory, Village()), kMaxRelativeError);
}

TEST(Tracker, FollowsOverFramesLeftOut) {
  std::vector<Frame> frames;
  for (const Frame& frame : Village().frames) {
    if (frame.index < 10 || frame.index % 4 == 0) frames.push_back(frame);
  }
  const Tracked run = TrackAll(frames);
  EXPECT_GE(run.trajectory.size() + 2, frames.size());
  for (const TrajectoryEntry& entry : run.trajectory) EXPECT_EQ(entry.map_id, 0);
  EXPECT_LT(RelativeError(run.trajectory, Village()), kMaxRelativeError);
}

// Ten frames of flight, twelve (1.2 s) of nothing, then 18 of what `after` shows.
std::vector<Frame> AfterALongLoss(const Sequence& after, std::size_t first_after) {
  std::vector<Frame> frames;
  for (std::size_t i = 0; i < 40; ++i) {
    const bool is_black = i >= 10 && i < 22;
    frames.push_back(is_black ? BlackFrame(static_cast<std::int64_t>(i))
                     : i < 10 ? Village().frames[i]
                              : after.frames[first_after + i - 22]);
    frames.back().index = static_cast<std::int64_t>(i);
    frames.back().timestamp_s = 0.1 * static_cast<double>(i);
  }
  return frames;
}

TEST(Tracker, StartsANewMapInAnotherPlaceAfterALongLoss) {
  Sequence mirrored = Village();  // what no camera over the village could see
  for (Frame& frame : mirrored.frames) {
    cv::Mat flipped;
    cv::flip(frame.bgr, flipped, 1);
    frame.bgr = flipped;
  }
  const Tracked run = TrackAll(AfterALongLoss(mirrored, 12));
  EXPECT_EQ(run.results[10].status, TrackingStatus::kLost);
  EXPECT_THAT(run.results[20].reason, HasSubstr("starting anew"));
  EXPECT_EQ(run.results[21].status, TrackingStatus::kNotInitialised);
  EXPECT_EQ(run.results.back().status, TrackingStatus::kTracking);
  EXPECT_EQ(run.results.back().map_id, 1);
  EXPECT_EQ(run.poses->At(run.keyframes.front().id).map_id, 0);
  EXPECT_EQ(run.poses->At(run.keyframes.back().id).map_id, 1);
  for (std::size_t i = 1; i < run.keyframes.size(); ++i) {
    EXPECT_EQ(run.keyframes[i].id, run.keyframes[i - 1].id + 1);  // counted over all maps
  }
}

TEST(Tracker, ReturnsToItsMapOnKnownGroundAfterALongLoss) {
  const Tracked run = TrackAll(AfterALongLoss(Village(), 4));
  EXPECT_THAT(run.results[20].reason, HasSubstr("starting anew"));
  EXPECT_EQ(run.results[22].status, TrackingStatus::kTracking);
  for (const TrajectoryEntry& entry : run.trajectory) EXPECT_EQ(entry.map_id, 0);
  // The frames after the loss show what the frames 4 to 21 of the flight did.
  Sequence truth = Village();
  truth.T_world_cam.resize(40);
  for (std::size_t i = 22; i < 40; ++i) truth.T_world_cam[i] = Village().T_world_cam[i - 18];
  EXPECT_LT(RelativeError(run.trajectory, truth), kMaxRelativeError);
}

TEST(Tracker, RefusesAnotherCameraAndABrokenFrame) {
  const std::unique_ptr<Tracker> tracker = CreateTracker();
  static_cast<void>(tracker->Track(BlackFrame(0)));
  Frame other = BlackFrame(1);
  other.camera.fx *= 2;
  EXPECT_THAT([&] { static_cast<void>(tracker->Track(other)); },
              testing::ThrowsMessage<Error>(HasSubstr("camera differs")));
  Frame broken = BlackFrame(1);
  broken.bgr = cv::Mat(3, 3, CV_8UC3, cv::Scalar(0, 0, 0));
  EXPECT_THROW(static_cast<void>(tracker->Track(broken)), Error);
}

TEST(Tracker, ReportsItsStageTimes) {
  StageTimes times;
  const std::unique_ptr<Tracker> tracker = CreateTracker({}, &times);
  static_cast<void>(tracker->Track(BlackFrame(0)));
  ASSERT_FALSE(times.Snapshot().empty());
  EXPECT_EQ(times.Snapshot()[0].stage, "tracking/octaves");
}

}  // namespace
}  // namespace mono3d::tracking
