// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/positions/position_following.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <numbers>
#include <thread>
#include <vector>

#include "mono3d/geometry/similarity.h"
#include "reference/random.h"
#include "tracking/positions/position_follower.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

constexpr KeyframeId kNumBent = 40;
constexpr double kStepOfBent = 1;
constexpr double kHeightOfBent = 10;
constexpr double kMetresOfBent = 6;  // of a unit of the map

// Straight on over rough ground; as a tracker has it whose scale grows by `drift` from each
// keyframe to the next.
struct BentMap {
  Map map{0, SmallCamera(), FeatureOptions{}};
  std::vector<Eigen::Vector3d> truth;  // camera centres, in units of the map at its start
};

BentMap MakeBentMap(double drift, double sigma_px = 0.3) {
  BentMap bent;
  std::mt19937 random(1);
  std::vector<Similarity> S_map_true;  // around each keyframe
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (KeyframeId i = 0; i < kNumBent; ++i) {
    const double scale = std::exp(drift * static_cast<double>(i));
    bent.truth.emplace_back(kStepOfBent * static_cast<double>(i), 0, 0);
    if (i > 0) centre += scale * (bent.truth[i] - bent.truth[i - 1]);
    S_map_true.emplace_back(scale,
                            Pose(Eigen::Quaterniond::Identity(), centre - scale * bent.truth[i]));
    View view;
    view.frame.index = static_cast<std::int64_t>(i);
    view.frame.timestamp_s = static_cast<double>(i);
    view.frame.camera = SmallCamera();
    view.T_cam_world = Pose(Eigen::Quaterniond::Identity(), centre).Inverse();
    bent.map.AddKeyframe(view);
  }
  for (int n = 0; n < 3000; ++n) {
    const Eigen::Vector3d p(Uniform(random, -5, kNumBent * kStepOfBent + 5), Uniform(random, -3, 3),
                            kHeightOfBent + Uniform(random, -1, 1));
    std::vector<KeyframeId> seeing;
    for (KeyframeId i = 0; i < kNumBent; ++i) {
      if (SmallCamera().Contains(SmallCamera().Project(p - bent.truth[i]))) seeing.push_back(i);
    }
    if (seeing.size() < 3) continue;
    const PointId point = bent.map.AddPoint(S_map_true[seeing[seeing.size() / 2]] * p);
    for (const KeyframeId i : seeing) {
      Feature feature;
      feature.pixel = SmallCamera().Project(p - bent.truth[i]);
      feature.sigma_px = sigma_px;
      bent.map.AddObservation(point, i, feature);
    }
    bent.map.UpdateGeometry(point);
  }
  return bent;
}

std::vector<TrajectoryEntry> FramesOf(const Map& map) {
  std::vector<TrajectoryEntry> frames;
  for (KeyframeId i = 0; i < kNumBent; ++i) {
    frames.push_back(
        {static_cast<std::int64_t>(i), static_cast<double>(i), 0, map.T_cam_world(i).Inverse()});
  }
  return frames;
}

// Without errors, of a receiver that has some of centimetres.
CameraPositions PositionsOf(const BentMap& bent) {
  CameraPositions positions;
  positions.S_metric_map = {kMetresOfBent, Pose()};
  for (KeyframeId i = 0; i < kNumBent; ++i) {
    positions.positions.push_back({static_cast<double>(i), kMetresOfBent * bent.truth[i]});
  }
  positions.typical_horizontal_m = positions.typical_vertical_m = 0.05;
  return positions;
}

// The step from the keyframe before, over the mean of all: how much the path is stretched there.
std::vector<double> StepsOf(const Map& map) {
  std::vector<double> steps;
  double sum = 0;
  for (KeyframeId i = 1; i < kNumBent; ++i) {
    steps.push_back((map.T_cam_world(i).Inverse().translation() -
                     map.T_cam_world(i - 1).Inverse().translation())
                        .norm());
    sum += steps.back() / (kNumBent - 1);
  }
  for (double& step : steps) step /= sum;
  return steps;
}

constexpr double kScaleDrift = 0.001;  // of scale from each keyframe to the next: 4 % in all

TEST(FollowPositions, StraightensTheWholeMapAtItsEnd) {
  BentMap bent = MakeBentMap(kScaleDrift);
  const std::vector<double> before = StepsOf(bent.map);
  CameraPositions positions = PositionsOf(bent);
  MappingLock alone;
  const std::optional<PositionFit> fit =
      FollowPositions(bent.map, FramesOf(bent.map), 0, positions, alone);
  ASSERT_TRUE(fit.has_value());
  const std::vector<double> after = StepsOf(bent.map);
  EXPECT_LT(std::abs(after.back() / after.front() - 1), 0.5 * (before.back() / before.front() - 1));
}

// Positions that wander off and back by a metre bend a path less, the better its points are known.
TEST(FollowPositions, BelieveTheImagesByHowExactTheirPointsAre) {
  std::vector<double> moved_m;
  for (const double sigma_px : {0.1, 1.0}) {
    BentMap bent = MakeBentMap(0, sigma_px);
    CameraPositions positions = PositionsOf(bent);
    for (CameraPosition& position : positions.positions) {
      position.p_m.y() += std::sin(std::numbers::pi * position.time_s / kNumBent);
    }
    positions.typical_horizontal_m = positions.typical_vertical_m = 1;
    MappingLock alone;
    const std::optional<PositionFit> fit =
        FollowPositions(bent.map, FramesOf(bent.map), 0, positions, alone);
    ASSERT_TRUE(fit.has_value());
    moved_m.push_back(fit->rms_moved_m);
  }
  EXPECT_LT(moved_m[0], 0.5 * moved_m[1]);
}

// What local adjustments still reach moves as one: its steps stay as the images have them.
TEST(FollowPositions, LeavesTheShapeOfTheNewestAsItIs) {
  constexpr std::size_t kOpen = 10;
  BentMap bent = MakeBentMap(kScaleDrift);
  const std::vector<double> before = StepsOf(bent.map);
  CameraPositions positions = PositionsOf(bent);
  MappingLock alone;
  ASSERT_TRUE(FollowPositions(bent.map, FramesOf(bent.map), kOpen, positions, alone).has_value());
  const std::vector<double> after = StepsOf(bent.map);
  constexpr std::size_t kLeader = kNumBent - 1 - kOpen;
  for (std::size_t i = kLeader; i + 1 < after.size(); ++i) {
    EXPECT_NEAR(after[i + 1] / after[i], before[i + 1] / before[i], 1e-9) << i;
  }
  EXPECT_LT(std::abs(after[kLeader - 1] / after[0] - 1),
            0.5 * (before[kLeader - 1] / before[0] - 1));
  const Similarity& moved = bent.map.keyframe(kNumBent - 1).S_world_visual;
  EXPECT_NEAR(moved.scale(), bent.map.keyframe(kLeader).S_world_visual.scale(), 1e-9);
}

// As a live tracker asks, keyframe after keyframe, until the map has moved. After a fit it rests
// for ten times as long, which under a sanitizer is a minute.
bool FollowsInTheEnd(PositionFollower& follower, BentMap& bent) {
  for (int i = 0; i < 10'000; ++i) {
    if (follower.FollowInBackground(
            bent.map, [&] { return FramesOf(bent.map); }, 0))
      return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return false;
}

TEST(PositionFollower, MovesTheMapInTheBackgroundAsItWouldAtOnce) {
  BentMap at_once = MakeBentMap(kScaleDrift);
  BentMap later = MakeBentMap(kScaleDrift);
  MappingLock alone;
  PositionFollower follower;
  follower.Set(PositionsOf(at_once));
  EXPECT_TRUE(follower.Follow(
      at_once.map, [&] { return FramesOf(at_once.map); }, 0, alone));
  EXPECT_FALSE(follower.Follow(
      at_once.map, [&] { return FramesOf(at_once.map); }, 0, alone));

  PositionFollower in_background;
  in_background.Set(PositionsOf(later));
  ASSERT_TRUE(FollowsInTheEnd(in_background, later));
  EXPECT_EQ(StepsOf(later.map), StepsOf(at_once.map));
  ASSERT_EQ(in_background.Fits().size(), 1U);
  EXPECT_EQ(in_background.Fits().front().rms_moved_m, follower.Fits().front().rms_moved_m);
}

// What was fitted to the map as it was is not laid upon it as it is.
TEST(PositionFollower, FitsAgainWhereTheMapHasMovedMeanwhile) {
  BentMap bent = MakeBentMap(kScaleDrift);
  PositionFollower follower;
  follower.Set(PositionsOf(bent));
  const std::vector<double> before = StepsOf(bent.map);
  const auto frames = [&] { return FramesOf(bent.map); };
  EXPECT_FALSE(follower.FollowInBackground(bent.map, frames, 0));
  follower.NoteMoved();
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  EXPECT_FALSE(follower.FollowInBackground(bent.map, frames, 0));
  EXPECT_EQ(StepsOf(bent.map), before);
  EXPECT_TRUE(FollowsInTheEnd(follower, bent));
  EXPECT_NE(StepsOf(bent.map), before);
}

// The end of a run does not wait for another turn.
TEST(PositionFollower, FollowsAtOnceWhatItWasFittingInTheBackground) {
  BentMap bent = MakeBentMap(kScaleDrift);
  PositionFollower follower;
  follower.Set(PositionsOf(bent));
  const auto frames = [&] { return FramesOf(bent.map); };
  EXPECT_FALSE(follower.FollowInBackground(bent.map, frames, 0));
  MappingLock alone;
  EXPECT_TRUE(follower.Follow(bent.map, frames, 0, alone));
}

}  // namespace
}  // namespace mono3d::tracking
