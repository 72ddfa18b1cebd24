// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gmock/gmock.h>

#include <memory>
#include <string>

#include "mono3d/core/error.h"
#include "mono3d/geometry/similarity.h"
#include "mono3d/image/sparse_model.h"
#include "mono3d/tracking/tracker.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr std::size_t kNumSavedFrames = 26;
constexpr std::size_t kNumSaved = 14;  // frames tracked before the map is saved

// Rendered once for all tests.
const Sequence& SavedVillage() {
  static const Sequence sequence = FlyOver(TexturedGround(true), kNumSavedFrames);
  return sequence;
}

std::unique_ptr<Tracker> TrackFirstHalf() {
  std::unique_ptr<Tracker> tracker = CreateTracker();
  for (std::size_t i = 0; i < kNumSaved; ++i) {
    static_cast<void>(tracker->Track(SavedVillage().frames[i]));
  }
  return tracker;
}

// The map of the first half, tracked once for all tests.
const std::string& SavedBytes() {
  static const std::string bytes = TrackFirstHalf()->SaveMap();
  return bytes;
}

struct Continued {
  std::vector<TrackingResult> results;
  std::unique_ptr<Tracker> tracker;
};

Continued GoOn(std::int64_t index_offset = 0) {
  Continued run;
  run.tracker = CreateTracker();
  run.tracker->LoadMap(SavedBytes(), "saved");
  for (std::size_t i = kNumSaved; i < kNumSavedFrames; ++i) {
    Frame frame = SavedVillage().frames[i];
    frame.index += index_offset;
    frame.timestamp_s += 0.1 * static_cast<double>(index_offset);
    run.results.push_back(run.tracker->Track(frame));
  }
  return run;
}

// Root mean square distance from the truth after alignment, over the flying height of 10.
double SavedMapError(const std::vector<TrajectoryEntry>& trajectory) {
  std::vector<Eigen::Vector3d> found;
  std::vector<Eigen::Vector3d> truth;
  for (const TrajectoryEntry& entry : trajectory) {
    found.push_back(entry.T_world_cam.translation());
    const auto index = static_cast<std::size_t>(entry.frame_index);
    truth.push_back(SavedVillage().T_world_cam.at(index).translation());
  }
  const Similarity fit = FitSimilarity(found, truth);
  double sum = 0;
  for (std::size_t i = 0; i < found.size(); ++i) sum += (fit * found[i] - truth[i]).squaredNorm();
  return std::sqrt(sum / static_cast<double>(found.size())) / 10;
}

TEST(SavedMap, IsGoneOnInFromTheFirstFrameWithOneTrajectory) {
  const Continued run = GoOn();
  for (const TrackingResult& result : run.results) {
    EXPECT_EQ(result.status, TrackingStatus::kTracking) << result.reason;
    EXPECT_EQ(result.map_id, 0);
  }
  const std::vector<TrajectoryEntry> trajectory = run.tracker->Trajectory();
  EXPECT_GE(trajectory.size(), kNumSavedFrames - 2);
  EXPECT_LT(trajectory.front().frame_index, 3);
  // A fifth of a pixel would be 0.06 %; see tracker_test.cpp.
  constexpr double kMaxRelativeError = 0.005;
  EXPECT_LT(SavedMapError(trajectory), kMaxRelativeError);
  // New ground has come into the map.
  EXPECT_GT(run.tracker->Sparse(0).images.size(), TrackFirstHalf()->Sparse(0).images.size());
}

TEST(SavedMap, HasItsKeyframesWhereTheyWere) {
  const KeyframePosesPtr saved = TrackFirstHalf()->Poses();
  const std::unique_ptr<Tracker> tracker = CreateTracker();
  tracker->LoadMap(SavedBytes(), "saved");
  const KeyframePosesPtr loaded = tracker->Poses();
  ASSERT_EQ(loaded->poses().size(), saved->poses().size());
  for (const KeyframePose& keyframe : saved->poses()) {
    const KeyframePose& same = loaded->At(keyframe.keyframe_id);
    EXPECT_EQ(same.map_id, 0);
    EXPECT_EQ(same.S_world_kf.scale(), keyframe.S_world_kf.scale());
    constexpr double kRounding = 1e-12;  // of rotations
    EXPECT_LT((same.T_world_cam().Matrix() - keyframe.T_world_cam().Matrix()).norm(), kRounding);
  }
  // New keyframes have other ids.
  const Continued run = GoOn();
  EXPECT_GT(run.tracker->Poses()->poses().size(), saved->poses().size());
  EXPECT_GT(run.tracker->Poses()->version(), loaded->version());
}

TEST(SavedMap, LeadsToTheSameBitsTwice) {
  const Continued first = GoOn();
  const Continued second = GoOn();
  EXPECT_TRUE(first.tracker->SaveMap() == second.tracker->SaveMap());
  const auto a = first.tracker->Trajectory();
  const auto b = second.tracker->Trajectory();
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].T_world_cam.Matrix(), b[i].T_world_cam.Matrix());
  }
}

TEST(SavedMap, LeavesItsFramesOutOfTheTrajectoryOfOtherFootage) {
  // The same flight filmed again, counted from zero.
  const Continued run = GoOn(-static_cast<std::int64_t>(kNumSaved));
  const auto trajectory = run.tracker->Trajectory();
  ASSERT_EQ(trajectory.size(), kNumSavedFrames - kNumSaved);
  EXPECT_EQ(trajectory.front().frame_index, 0);
  EXPECT_LE(run.tracker->KeyframeTrajectory().size(), kNumSavedFrames - kNumSaved);
  EXPECT_GE(run.tracker->KeyframeTrajectory().size(), 1U);
}

TEST(SavedMap, IsTheSameWhenSavedAgain) {
  const std::unique_ptr<Tracker> tracker = CreateTracker();
  tracker->LoadMap(SavedBytes(), "saved");
  const SparseModel before = TrackFirstHalf()->Sparse(0);
  const SparseModel after = tracker->Sparse(0);
  ASSERT_EQ(after.points.size(), before.points.size());
  for (std::size_t i = 0; i < after.points.size(); ++i) {
    EXPECT_EQ(after.points[i].p_world, before.points[i].p_world);
    EXPECT_EQ(after.points[i].colour, before.points[i].colour);
  }
  EXPECT_EQ(tracker->SaveMap().size(), SavedBytes().size());
}

TEST(SavedMap, IsRefusedWhenForeignDamagedOrOfAnotherVersion) {
  const auto load = [](std::string bytes) {
    return [bytes = std::move(bytes)] { CreateTracker()->LoadMap(bytes, "a.map"); };
  };
  EXPECT_THAT(load(""), ThrowsMessage<Error>(HasSubstr("a.map: saved map: not one of mono3d")));
  EXPECT_THAT(load("ply\nformat ascii 1.0\n"), ThrowsMessage<Error>(HasSubstr("not one of")));
  for (const std::size_t size : {12U, 20U, 1000U}) {
    EXPECT_THROW(load(SavedBytes().substr(0, size))(), Error) << size;
  }
  EXPECT_THAT(load(SavedBytes().substr(0, SavedBytes().size() - 1)),
              ThrowsMessage<Error>(HasSubstr("damaged")));
  std::string changed = SavedBytes();
  changed[changed.size() / 2] = static_cast<char>(changed[changed.size() / 2] ^ 1);
  EXPECT_THAT(load(changed), ThrowsMessage<Error>(HasSubstr("damaged")));
  std::string older = SavedBytes();
  older[11] = 3;  // behind the eleven bytes of "mono3d map\n"; that of mono3d 0.1
  EXPECT_THAT(load(older),
              ThrowsMessage<Error>(AllOf(HasSubstr("make it again from its images"),
                                         HasSubstr("(expected version 6, found version 3)"))));
}

TEST(SavedMap, NeedsATrackerThatHasNotBegunAndSeesItsCamera) {
  const std::unique_ptr<Tracker> begun = CreateTracker();
  static_cast<void>(begun->Track(BlackFrame(0)));
  EXPECT_THROW(begun->LoadMap(SavedBytes(), "saved"), UsageError);
  EXPECT_THAT([&] { static_cast<void>(begun->SaveMap()); },
              ThrowsMessage<Error>(HasSubstr("no map to save")));
  TrackerOptions options;
  options.features.num_levels = 7;
  EXPECT_THAT([&] { CreateTracker(options)->LoadMap(SavedBytes(), "saved"); },
              ThrowsMessage<UsageError>(HasSubstr("other pyramid levels")));
  const std::unique_ptr<Tracker> tracker = CreateTracker();
  tracker->LoadMap(SavedBytes(), "saved");
  Frame other = BlackFrame(50);
  other.camera.fx *= 2;
  EXPECT_THAT([&] { static_cast<void>(tracker->Track(other)); },
              ThrowsMessage<Error>(HasSubstr("camera differs")));
}

TEST(SparseExport, HasTheKeyframesAndPointsOfTheMap) {
  const std::unique_ptr<Tracker> tracker = TrackFirstHalf();
  const SparseModel model = tracker->Sparse(0);
  EXPECT_NO_THROW(Validate(model));
  EXPECT_EQ(model.images.size(), tracker->KeyframeTrajectory().size());  // none culled yet
  std::size_t num_observations = 0;
  for (const SparseImage& image : model.images) num_observations += image.observations.size();
  EXPECT_GT(num_observations, 2 * model.points.size());  // two of each point at least
  double sum = 0;
  for (const double error_px : ReprojectionErrors_px(model)) sum += error_px;
  EXPECT_LT(sum / static_cast<double>(model.points.size()), 1);
  EXPECT_TRUE(tracker->Sparse(1).images.empty());
}

TEST(SparseExport, NumbersImagesByTheirFramesInTheOrderOfFlight) {
  const SparseModel model = TrackFirstHalf()->Sparse(0);
  std::int64_t last = -1;
  for (const SparseImage& image : model.images) {
    EXPECT_GT(image.id, last);
    EXPECT_EQ(image.name, SavedVillage().frames.at(static_cast<std::size_t>(image.id)).name);
    last = image.id;
  }
  // Frames of two flights with the same indices: the ids are others, but still unique.
  const SparseModel of_two = GoOn(-static_cast<std::int64_t>(kNumSaved)).tracker->Sparse(0);
  EXPECT_NO_THROW(Validate(of_two));
  EXPECT_GT(of_two.images.size(), model.images.size());
}

}  // namespace
}  // namespace mono3d::tracking
