// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The snapshots of keyframe poses: of maps made by hand, then of the whole tracker.

#include "tracking/map/published_poses.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "mono3d/tracking/tracker.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

constexpr double kPublishedRounding = 1e-12;

double Difference(const Similarity& a, const Similarity& b) {
  return (a.pose().Matrix() - b.pose().Matrix()).norm() + std::abs(a.scale() - b.scale());
}

void ExpectEqual(const KeyframePoses& a, const KeyframePoses& b) {
  ASSERT_EQ(a.poses().size(), b.poses().size());
  for (std::size_t i = 0; i < a.poses().size(); ++i) {
    EXPECT_EQ(a.poses()[i].keyframe_id, b.poses()[i].keyframe_id);
    EXPECT_EQ(a.poses()[i].map_id, b.poses()[i].map_id);
    EXPECT_EQ(Difference(a.poses()[i].S_world_kf, b.poses()[i].S_world_kf), 0);
  }
}

// Three keyframes at x = 0, 1, 2 with the ids 10, 11, 12, of which the middle one is culled.
std::vector<std::unique_ptr<Map>> OneMap() {
  std::vector<std::unique_ptr<Map>> maps;
  maps.push_back(std::make_unique<Map>(0, SmallCamera(), FeatureOptions{}));
  for (int i = 0; i < 3; ++i) {
    View view = MakeView(SmallCamera(), {{50, 50}});
    view.T_cam_world = Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-i, 0, 0));
    maps[0]->keyframe(maps[0]->AddKeyframe(std::move(view))).id = 10 + i;
  }
  maps[0]->RemoveKeyframe(1, 0);
  return maps;
}

TEST(PublishedPoses, AreEmptyAtFirst) {
  const PublishedPoses poses;
  ASSERT_NE(poses.Latest(), nullptr);
  EXPECT_EQ(poses.Latest()->version(), 0U);
  EXPECT_TRUE(poses.Latest()->poses().empty());
}

TEST(PublishedPoses, HaveTheCulledKeyframesToo) {
  PublishedPoses poses;
  poses.Publish(OneMap());
  const KeyframePosesPtr snapshot = poses.Latest();
  EXPECT_EQ(snapshot->version(), 1U);
  ASSERT_EQ(snapshot->poses().size(), 3U);
  for (const std::int64_t id : {10, 11, 12}) {
    EXPECT_EQ(snapshot->At(id).map_id, 0);
    EXPECT_EQ(snapshot->At(id).S_world_kf.scale(), 1);
    EXPECT_EQ(snapshot->At(id).T_world_cam().translation().x(), static_cast<double>(id - 10));
  }
}

// Worked by hand: the first keyframe takes twice the lengths around itself, the last one stays.
TEST(PublishedPoses, HaveCulledKeyframesWhoseAnchorIsCulledToo) {
  std::vector<std::unique_ptr<Map>> maps = OneMap();
  maps[0]->RemoveKeyframe(2, 1);
  PublishedPoses published;
  published.Publish(maps);
  for (KeyframeId id = 0; id < 3; ++id) {
    EXPECT_EQ(Difference(published.Latest()->At(10 + static_cast<std::int64_t>(id)).S_world_kf,
                         maps[0]->S_world_kf(id)),
              0);
  }
}

TEST(PublishedPoses, FollowACorrectionWhileAnOldSnapshotStays) {
  const std::vector<std::unique_ptr<Map>> maps = OneMap();
  PublishedPoses poses;
  poses.Publish(maps);
  const KeyframePosesPtr before = poses.Latest();
  const KeyframePoses copy = *before;
  maps[0]->Correct(
      {0, 2}, {Similarity(0.5, maps[0]->T_cam_world(0)), Similarity(1, maps[0]->T_cam_world(2))});
  poses.Publish(maps);
  ExpectEqual(*before, copy);
  const KeyframePosesPtr after = poses.Latest();
  EXPECT_EQ(after->version(), 2U);
  EXPECT_EQ(after->At(10).S_world_kf.scale(), 2);
  EXPECT_EQ(after->At(11).S_world_kf.scale(), 2);
  EXPECT_EQ(after->At(12).S_world_kf.scale(), 1);
  EXPECT_EQ(after->At(11).T_world_cam().translation().x(), 2);  // it was 1 from its anchor
}

// Rendered once for all tests.
const Sequence& Field() {
  static const Sequence sequence = FlyOver(TexturedGround(false), 60);
  return sequence;
}

// The frames 0 to 11, so long nothing that a new map starts, then from far away back to where the
// first map was made.
std::vector<Frame> FilmOfTwoMaps() {
  std::vector<cv::Mat> images;
  for (std::size_t i = 0; i < 12; ++i) images.push_back(Field().frames[i].bgr);
  for (int i = 0; i < 12; ++i) images.push_back(BlackFrame(0).bgr);
  for (std::size_t i = 59; i > 8; i -= 2) images.push_back(Field().frames[i].bgr);
  std::vector<Frame> frames;
  for (std::size_t i = 0; i < images.size(); ++i) {
    frames.push_back(BlackFrame(static_cast<std::int64_t>(i)));
    frames.back().bgr = images[i];
  }
  return frames;
}

struct PublishedTrack {
  std::vector<TrackingResult> results;
  std::vector<KeyframePosesPtr> poses;  // after each frame
  std::vector<Keyframe> keyframes;      // handed out
  std::vector<TrajectoryEntry> trajectory;
  std::vector<TrajectoryEntry> keyframe_trajectory;
};

PublishedTrack TrackTwoMaps(const std::string& mode) {
  TrackerOptions options;
  options.mode = mode;
  const std::unique_ptr<Tracker> tracker = CreateTracker(options);
  PublishedTrack run;
  const auto take = [&](const std::vector<Keyframe>& finalised) {
    run.keyframes.insert(run.keyframes.end(), finalised.begin(), finalised.end());
  };
  for (const Frame& frame : FilmOfTwoMaps()) {
    run.results.push_back(tracker->Track(frame));
    run.poses.push_back(tracker->Poses());
    take(run.results.back().finalised_keyframes);
  }
  tracker->WaitForMapping();
  take(tracker->Finish());
  run.poses.push_back(tracker->Poses());
  run.trajectory = tracker->Trajectory();
  run.keyframe_trajectory = tracker->KeyframeTrajectory();
  return run;
}

const PublishedTrack& TwoMaps() {
  static const PublishedTrack run = TrackTwoMaps("sequential");
  return run;
}

// What holds in both modes.
void ExpectPosesOfAllThatIsNamed(const PublishedTrack& run) {
  std::uint64_t version = 0;
  for (std::size_t i = 0; i < run.results.size(); ++i) {
    const KeyframePoses& poses = *run.poses[i];
    const TrackingResult& result = run.results[i];
    EXPECT_GE(poses.version(), version);
    if (result.is_keyframe) {
      EXPECT_GT(poses.version(), version);
    }
    version = poses.version();
    EXPECT_EQ(result.pose.has_value(), result.T_world_cam.has_value());
    if (result.pose) {
      EXPECT_NE(poses.Find(result.pose->keyframe_id), nullptr);
    }
    for (const FramePose& pose : result.recovered) {
      ASSERT_NE(poses.Find(pose.keyframe_id), nullptr);
      EXPECT_EQ(poses.At(pose.keyframe_id).map_id, result.map_id);
    }
    for (const Keyframe& keyframe : result.finalised_keyframes) {
      EXPECT_NE(poses.Find(keyframe.id), nullptr);
    }
  }
}

// By now, each frame by what the tracker said of it when it came.
void ExpectTheTrajectory(const PublishedTrack& run) {
  std::vector<TrajectoryEntry> entries;
  const auto add = [&](const FramePose& pose) {
    entries.push_back(InWorld(pose, *run.poses.back()).value());
  };
  for (const TrackingResult& result : run.results) {
    for (const FramePose& pose : result.recovered) add(pose);
    if (result.pose) add(*result.pose);
  }
  std::int64_t last_final = -1;
  for (const TrackingResult& result : run.results) {
    for (const FramePose& pose : result.refined) {
      std::erase_if(entries, [&](const auto& old) { return old.frame_index == pose.frame_index; });
      add(pose);
    }
    for (const Keyframe& keyframe : result.finalised_keyframes) {
      last_final = std::max(last_final, keyframe.frame.index);
    }
  }
  ASSERT_GT(last_final, 20);
  ASSERT_EQ(entries.size(), run.trajectory.size());
  std::sort(entries.begin(), entries.end(),
            [](const auto& a, const auto& b) { return a.frame_index < b.frame_index; });
  for (std::size_t i = 0; i < entries.size(); ++i) {
    EXPECT_EQ(entries[i].frame_index, run.trajectory[i].frame_index);
    EXPECT_EQ(entries[i].timestamp_s, run.trajectory[i].timestamp_s);
    EXPECT_EQ(entries[i].map_id, run.trajectory[i].map_id);
    // Frames after the last final keyframe became better with Finish.
    EXPECT_LT((entries[i].T_world_cam.Matrix() - run.trajectory[i].T_world_cam.Matrix()).norm(),
              entries[i].frame_index < last_final ? kPublishedRounding : 0.01);
  }
}

TEST(Poses, NameEveryKeyframeThatAFrameIsFixedTo) { ExpectPosesOfAllThatIsNamed(TwoMaps()); }

TEST(Poses, GiveTheTrajectoryFromWhatWasSaidOfEachFrame) { ExpectTheTrajectory(TwoMaps()); }

TEST(Poses, AgreeWithTheOnlinePoseOfEachFrame) {
  const PublishedTrack& run = TwoMaps();
  for (std::size_t i = 0; i < run.results.size(); ++i) {
    if (!run.results[i].pose) continue;
    const TrajectoryEntry entry = InWorld(*run.results[i].pose, *run.poses[i]).value();
    EXPECT_EQ(entry.map_id, run.results[i].map_id);
    EXPECT_LT((entry.T_world_cam.Matrix() - run.results[i].T_world_cam->Matrix()).norm(),
              kPublishedRounding);
  }
}

TEST(Poses, AreThoseOfTheKeyframeTrajectory) {
  const PublishedTrack& run = TwoMaps();
  const KeyframePoses& poses = *run.poses.back();
  ASSERT_EQ(poses.poses().size(), run.keyframe_trajectory.size());
  ASSERT_EQ(run.keyframes.size(), run.keyframe_trajectory.size());
  for (const TrajectoryEntry& entry : run.keyframe_trajectory) {
    const auto keyframe = std::find_if(
        run.keyframes.begin(), run.keyframes.end(),
        [&](const Keyframe& candidate) { return candidate.frame.index == entry.frame_index; });
    ASSERT_NE(keyframe, run.keyframes.end());
    EXPECT_EQ(poses.At(keyframe->id).map_id, entry.map_id);
    EXPECT_EQ(poses.At(keyframe->id).T_world_cam().Matrix(), entry.T_world_cam.Matrix());
  }
}

TEST(Poses, GiveTheSameSnapshotsTwice) {
  const PublishedTrack again = TrackTwoMaps("sequential");
  ASSERT_EQ(again.poses.size(), TwoMaps().poses.size());
  for (std::size_t i = 0; i < again.poses.size(); ++i) {
    EXPECT_EQ(again.poses[i]->version(), TwoMaps().poses[i]->version());
    ExpectEqual(*again.poses[i], *TwoMaps().poses[i]);
  }
}

TEST(Poses, TakeAnotherMapAndScaleByAJoin) {
  const PublishedTrack& run = TwoMaps();
  std::size_t at = 0;
  for (std::size_t i = 1; i < run.poses.size(); ++i) {
    if (!FindMapJoins(*run.poses[i - 1], *run.poses[i]).empty()) at = i;
  }
  ASSERT_GT(at, 0U);
  const KeyframePoses& before = *run.poses[at - 1];
  const KeyframePoses& after = *run.poses[at];
  const MapJoin join = FindMapJoins(before, after)[0];
  EXPECT_EQ(join.from, 1);
  EXPECT_EQ(join.into, 0);
  int num_moved = 0;
  for (const KeyframePose& was : before.poses()) {
    const KeyframePose& is = after.At(was.keyframe_id);
    EXPECT_EQ(is.map_id, 0);
    if (was.map_id == 0) continue;
    ++num_moved;
    // All by much the same: the adjustment that follows moves each by a little.
    constexpr double kShare = 0.02;
    const Similarity expected = join.S_into_from * was.S_world_kf;
    EXPECT_EQ(was.S_world_kf.scale(), 1);
    EXPECT_NE(is.S_world_kf.scale(), 1);
    EXPECT_NEAR(is.S_world_kf.scale(), expected.scale(), kShare * expected.scale());
    EXPECT_LT((is.T_world_cam().translation() - expected.pose().translation()).norm(),
              kShare * expected.scale());
  }
  EXPECT_GT(num_moved, 2);
}

TEST(Poses, CanBeTakenWhileAnotherThreadMaps) {
  TrackerOptions options;
  options.mode = "live";
  const std::unique_ptr<Tracker> tracker = CreateTracker(options);
  std::atomic<bool> is_over = false;
  std::atomic<int> num_taken = 0;
  std::thread reader([&] {
    std::uint64_t version = 0;
    while (!is_over) {
      const KeyframePosesPtr poses = tracker->Poses();
      EXPECT_GE(poses->version(), version);
      version = poses->version();
      for (const KeyframePose& pose : poses->poses()) EXPECT_GT(pose.S_world_kf.scale(), 0);
      ++num_taken;
    }
  });
  KeyframePosesPtr early;
  std::vector<KeyframePose> early_poses;
  for (const Frame& frame : FilmOfTwoMaps()) {
    const TrackingResult result = tracker->Track(frame);
    if (result.pose) {
      EXPECT_NE(tracker->Poses()->Find(result.pose->keyframe_id), nullptr);
    }
    if (early != nullptr || !result.pose) continue;
    early = tracker->Poses();
    early_poses.assign(early->poses().begin(), early->poses().end());
  }
  tracker->WaitForMapping();
  is_over = true;
  reader.join();
  EXPECT_GT(num_taken, 0);
  ASSERT_NE(early, nullptr);
  EXPECT_GT(tracker->Poses()->version(), early->version());
  ExpectEqual(*early, KeyframePoses(early->version(), early_poses));
}

TEST(Poses, HoldLiveAsWell) {
  const PublishedTrack run = TrackTwoMaps("live");
  ExpectPosesOfAllThatIsNamed(run);
  ExpectTheTrajectory(run);
}

}  // namespace
}  // namespace mono3d::tracking
