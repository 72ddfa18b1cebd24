// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Tracking while another thread maps: the same flight again and again, as fast as it goes.

#include <gmock/gmock.h>

#include <cmath>

#include "mono3d/core/error.h"
#include "mono3d/geometry/similarity.h"
#include "mono3d/tracking/tracker.h"
#include "tracking/mapping_thread.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

const Sequence& Village() {
  static const Sequence sequence = FlyOver(TexturedGround(true), 30);
  return sequence;
}

TrackerOptions Live() {
  TrackerOptions options;
  options.mode = "live";
  return options;
}

// Root mean square distance from the truth after alignment, over the flying height of 10.
double RelativeError(const std::vector<TrajectoryEntry>& trajectory) {
  std::vector<Eigen::Vector3d> found;
  std::vector<Eigen::Vector3d> truth;
  for (const TrajectoryEntry& entry : trajectory) {
    found.push_back(entry.T_world_cam.translation());
    truth.push_back(
        Village().T_world_cam[static_cast<std::size_t>(entry.frame_index)].translation());
  }
  const Similarity fit = FitSimilarity(found, truth);
  double sum = 0;
  for (std::size_t i = 0; i < found.size(); ++i) sum += (fit * found[i] - truth[i]).squaredNorm();
  return std::sqrt(sum / static_cast<double>(found.size())) / 10;
}

// How much of the mapping is done by the time of a frame depends on what else the machine does, and
// so does the error. No run is worse than what the sequential mode is held to.
TEST(LiveTracking, IsAccurateEachTime) {
  constexpr int kNumRuns = 10;
  constexpr double kMaxRelativeError = 0.005;
  for (int run = 0; run < kNumRuns; ++run) {
    const std::unique_ptr<Tracker> tracker = CreateTracker(Live());
    std::size_t num_keyframes = 0;
    for (const Frame& frame : Village().frames) {
      num_keyframes += tracker->Track(frame).settled_keyframes.size();
    }
    EXPECT_TRUE(tracker->WaitForMapping().empty());  // no loop, no other map
    num_keyframes += tracker->Finish().size();
    const std::vector<TrajectoryEntry> trajectory = tracker->Trajectory();
    EXPECT_EQ(trajectory.size(), Village().frames.size());
    EXPECT_EQ(num_keyframes, tracker->KeyframeTrajectory().size());
    EXPECT_LT(RelativeError(trajectory), kMaxRelativeError);
  }
}

TEST(LiveTracking, EndsInTheMiddleOfItsWork) {
  const std::unique_ptr<Tracker> tracker = CreateTracker(Live());
  for (std::size_t i = 0; i < 12; ++i) static_cast<void>(tracker->Track(Village().frames[i]));
  EXPECT_FALSE(tracker->Trajectory().empty());
}

TEST(LiveTracking, ComesBackAfterBlackFrames) {
  const std::unique_ptr<Tracker> tracker = CreateTracker(Live());
  std::size_t num_lost = 0;
  for (const Frame& frame : Village().frames) {
    const bool is_black = frame.index >= 14 && frame.index < 17;
    const TrackingResult result = tracker->Track(is_black ? BlackFrame(frame.index) : frame);
    num_lost += result.status == TrackingStatus::kLost ? 1U : 0U;
  }
  static_cast<void>(tracker->Finish());
  EXPECT_EQ(num_lost, 3U);
  for (const TrajectoryEntry& entry : tracker->Trajectory()) EXPECT_EQ(entry.map_id, 0);
}

TEST(TrackerOptions, RefuseAModeThatThereIsNot) {
  TrackerOptions options;
  options.mode = "parallel";
  EXPECT_THAT([&] { options.Validate(); }, ThrowsMessage<UsageError>(HasSubstr("tracking.mode")));
}

TEST(MappingThread, MapsKeyframesInOrderThenAdjustsUntilItIsDone) {
  std::vector<KeyframeId> mapped;  // touched with the map taken alone
  int num_adjustments = 0;
  MappingThread* self = nullptr;
  MappingThread thread({.map_keyframe =
                            [&](KeyframeId keyframe, MappingTurn& turn) {
                              mapped.push_back(keyframe);
                              turn.Breathe();
                              if (keyframe == 3) self->RequestAdjustment();
                            },
                        .adjust_all =
                            [&](MappingTurn&) {
                              ++num_adjustments;
                              return num_adjustments == 2;  // interrupted once
                            }});
  TrackingTurn turn(thread.turns());
  self = &thread;
  for (const KeyframeId keyframe : {1U, 2U, 3U}) {
    thread.Add(keyframe);
    thread.WaitForRoom(turn);
  }
  thread.Wait(turn);
  EXPECT_THAT(mapped, ElementsAre(1U, 2U, 3U));
  EXPECT_EQ(num_adjustments, 2);
}

TEST(MappingThread, HandsOnWhatItsWorkThrows) {
  MappingThread thread({.map_keyframe = [](KeyframeId, MappingTurn&) { throw Error("no room"); },
                        .adjust_all = [](MappingTurn&) { return true; }});
  TrackingTurn turn(thread.turns());
  thread.Add(1);
  EXPECT_THAT([&] { thread.Wait(turn); }, ThrowsMessage<Error>(HasSubstr("no room")));
}

}  // namespace
}  // namespace mono3d::tracking
