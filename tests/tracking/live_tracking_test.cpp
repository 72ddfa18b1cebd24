// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Tracking while another thread maps: the same flight again and again, as fast as it goes.

#include <gmock/gmock.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <thread>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/core/timing.h"
#include "mono3d/geometry/similarity.h"
#include "mono3d/tracking/tracker.h"
#include "tracking/mapping_thread.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

const Sequence& LiveVillage() {
  static const Sequence sequence = FlyOver(TexturedGround(true), 30);
  return sequence;
}

const Sequence& LiveField() {
  static const Sequence sequence = FlyOver(TexturedGround(false), 60);
  return sequence;
}
constexpr std::size_t kBlack = 1000;  // in place of the number of a frame

TrackerOptions Live() {
  TrackerOptions options;
  options.mode = "live";
  return options;
}

// Root mean square distance from the truth after alignment, over the flying height of 10.
double LiveRelativeError(const std::vector<TrajectoryEntry>& trajectory) {
  std::vector<Eigen::Vector3d> found;
  std::vector<Eigen::Vector3d> truth;
  for (const TrajectoryEntry& entry : trajectory) {
    found.push_back(entry.T_world_cam.translation());
    truth.push_back(
        LiveVillage().T_world_cam[static_cast<std::size_t>(entry.frame_index)].translation());
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
    for (const Frame& frame : LiveVillage().frames) {
      num_keyframes += tracker->Track(frame).finalised_keyframes.size();
    }
    tracker->WaitForMapping();
    for (const KeyframePose& keyframe : tracker->Poses()->poses()) {
      EXPECT_EQ(keyframe.S_world_kf.scale(), 1);  // no loop, no other map
    }
    num_keyframes += tracker->Finish().size();
    const std::vector<TrajectoryEntry> trajectory = tracker->Trajectory();
    EXPECT_EQ(trajectory.size(), LiveVillage().frames.size());
    EXPECT_EQ(num_keyframes, tracker->KeyframeTrajectory().size());
    EXPECT_LT(LiveRelativeError(trajectory), kMaxRelativeError);
  }
}

TEST(LiveTracking, EndsInTheMiddleOfItsWork) {
  const std::unique_ptr<Tracker> tracker = CreateTracker(Live());
  for (std::size_t i = 0; i < 12; ++i) static_cast<void>(tracker->Track(LiveVillage().frames[i]));
  EXPECT_FALSE(tracker->Trajectory().empty());
}

TEST(LiveTracking, ComesBackAfterBlackFrames) {
  const std::unique_ptr<Tracker> tracker = CreateTracker(Live());
  std::size_t num_lost = 0;
  for (const Frame& frame : LiveVillage().frames) {
    const bool is_black = frame.index >= 14 && frame.index < 17;
    const TrackingResult result = tracker->Track(is_black ? BlackFrame(frame.index) : frame);
    num_lost += result.status == TrackingStatus::kLost ? 1U : 0U;
  }
  static_cast<void>(tracker->Finish());
  EXPECT_EQ(num_lost, 3U);
  for (const TrajectoryEntry& entry : tracker->Trajectory()) EXPECT_EQ(entry.map_id, 0);
}

// What was mapped of another map, of which the first knows a part, moves over in the background.
TEST(LiveTracking, JoinsTwoMapsWhenTheyMeet) {
  const std::unique_ptr<Tracker> tracker = CreateTracker(Live());
  std::vector<std::size_t> film;
  for (std::size_t i = 0; i < 12; ++i) film.push_back(i);
  film.insert(film.end(), 12, kBlack);
  // Far away, then back to where the first map was made.
  for (std::size_t i = 59; i > 8; i -= 2) film.push_back(i);
  std::set<int> maps_used;
  std::set<std::int64_t> finalised;
  KeyframePosesPtr before;  // with two maps
  for (std::size_t i = 0; i < film.size(); ++i) {
    Frame frame = BlackFrame(static_cast<std::int64_t>(i));
    if (film[i] != kBlack) frame.bgr = LiveField().frames[film[i]].bgr;
    const TrackingResult result = tracker->Track(frame);
    if (result.T_world_cam) maps_used.insert(result.map_id);
    if (result.T_world_cam && result.map_id == 1) before = tracker->Poses();
    for (const Keyframe& keyframe : result.finalised_keyframes) finalised.insert(keyframe.id);
  }
  tracker->WaitForMapping();
  static_cast<void>(tracker->Finish());
  const KeyframePosesPtr after = tracker->Poses();
  ASSERT_NE(before, nullptr);
  ASSERT_EQ(FindMapJoins(*before, *after).size(), 1U);
  EXPECT_EQ(FindMapJoins(*before, *after)[0].from, 1);
  EXPECT_EQ(FindMapJoins(*before, *after)[0].into, 0);
  for (const std::int64_t id : finalised) EXPECT_EQ(after->At(id).map_id, 0);
  EXPECT_EQ(maps_used.count(1), 1U);
  for (const TrajectoryEntry& entry : tracker->Trajectory()) EXPECT_EQ(entry.map_id, 0);
}

// The map moves while frames are tracked and keyframes come.
TEST(LiveTracking, FollowsWhatItIsToldDuringTheFlight) {
  const std::unique_ptr<Tracker> tracker = CreateTracker(Live());
  std::optional<Keyframe> anchor;
  std::size_t num_told = 0;
  for (const Frame& frame : LiveVillage().frames) {
    const TrackingResult result = tracker->Track(frame);
    EXPECT_TRUE(result.T_world_cam.has_value() || num_told == 0) << result.reason;
    for (const Keyframe& keyframe : result.finalised_keyframes) {
      if (!anchor) anchor = keyframe;
      if (keyframe.id < anchor->id + 3) continue;
      // A pixel away from where it is, which is 0.003 rad.
      const Pose error(RotationExp({0.002, -0.001, 0.003}), {0.004, 0.002, 0});
      KeyframeConstraint constraint;
      constraint.id = keyframe.id;
      constraint.anchor_id = anchor->id;
      const KeyframePosesPtr poses = tracker->Poses();
      const Similarity S_anchor_kf =
          poses->At(anchor->id).S_world_kf.Inverse() * poses->At(keyframe.id).S_world_kf;
      constraint.T_cam_anchor = error * S_anchor_kf.pose().Inverse();
      constraint.scale = S_anchor_kf.scale();
      constraint.information.setIdentity();
      constraint.information *= 1e8;  // one sigma is a thirtieth of a pixel
      tracker->Constrain(std::vector<KeyframeConstraint>{constraint});
      ++num_told;
    }
  }
  tracker->WaitForMapping();
  static_cast<void>(tracker->Finish());
  EXPECT_GT(num_told, 0U);
  // Nothing else changes lengths here, see IsAccurateEachTime.
  const KeyframePosesPtr poses = tracker->Poses();
  EXPECT_TRUE(
      std::any_of(poses->poses().begin(), poses->poses().end(),
                  [](const KeyframePose& keyframe) { return keyframe.S_world_kf.scale() != 1; }));
  EXPECT_EQ(tracker->Trajectory().size(), LiveVillage().frames.size());
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
                            [&](KeyframeId keyframe, MappingLock& lock) {
                              mapped.push_back(keyframe);
                              lock.Yield();
                              if (keyframe == 3) self->RequestAdjustment();
                            },
                        .adjust_all =
                            [&](MappingLock&) {
                              ++num_adjustments;
                              return num_adjustments == 2;  // interrupted once
                            }});
  TrackingLock lock(thread.mutex());
  self = &thread;
  for (const KeyframeId keyframe : {1U, 2U, 3U}) {
    thread.Add(keyframe);
    thread.WaitForRoom(lock);
  }
  thread.Wait(lock);
  EXPECT_THAT(mapped, ElementsAre(1U, 2U, 3U));
  EXPECT_EQ(num_adjustments, 2);
}

// Of a large map an adjustment comes to no end between two keyframes: it must not take all the
// time that they leave.
TEST(MappingThread, RestsAfterAnAdjustmentThatWasInterrupted) {
  constexpr double kCpu_ms = 20;
  std::atomic<int> num_adjustments = 0;
  std::atomic<bool> is_done = false;
  MappingThread* self = nullptr;
  MappingThread thread(
      {.map_keyframe = [&](KeyframeId, MappingLock&) { self->RequestAdjustment(); },
       .adjust_all =
           [&](MappingLock&) {
             ++num_adjustments;
             const double start_ms = ThreadCpuMs();
             while (ThreadCpuMs() < start_ms + kCpu_ms) continue;
             return is_done.load();
           }});
  self = &thread;
  {
    TrackingLock lock(thread.mutex());
    thread.Add(1);
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  EXPECT_LE(num_adjustments, 3);  // one every 200 ms
  // Whoever waits for all of it does not wait for that.
  is_done = true;
  TrackingLock lock(thread.mutex());
  thread.Wait(lock);
  EXPECT_LE(num_adjustments, 5);
}

TEST(MappingThread, HandsOnWhatItsWorkThrows) {
  MappingThread thread({.map_keyframe = [](KeyframeId, MappingLock&) { throw Error("no room"); },
                        .adjust_all = [](MappingLock&) { return true; }});
  TrackingLock lock(thread.mutex());
  thread.Add(1);
  EXPECT_THAT([&] { thread.Wait(lock); }, ThrowsMessage<Error>(HasSubstr("no room")));
}

}  // namespace
}  // namespace mono3d::tracking
