// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/position_feed.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "image/state_archive.h"
#include "mono3d/geometry/geodetic.h"

namespace mono3d {
namespace {

using Eigen::Vector3d;

constexpr Geodetic kTakeOff = {49.01, 8.41, 115};
constexpr double kUnitOfMap_m = 20;

// An arc at 8 m/s.
Vector3d OnArc(double time_s) {
  return {200 * std::sin(0.04 * time_s), 200 * std::cos(0.04 * time_s), 50 + time_s};
}

// Has a flight of two maps, and keeps what it is told.
class ToldTracker final : public Tracker {
 public:
  TrackingResult Track(const Frame&) override { return {}; }
  KeyframePosesPtr Poses() const override { return std::make_shared<const KeyframePoses>(); }
  std::vector<Keyframe> Finish() override { return {}; }
  std::vector<TrajectoryEntry> Trajectory() const override {
    std::vector<TrajectoryEntry> entries;
    for (int i = 0; i <= 600; ++i) {
      const double time_s = 0.1 * i;
      // Looking ahead and down, its right level.
      const Pose T_enu_cam(RotationExp({0, 0, -0.04 * time_s}) * RotationExp({-2, 0, 0}),
                           OnArc(time_s));
      const Similarity S_map_enu(1 / kUnitOfMap_m, Pose());
      entries.push_back({i, time_s, i < 5 ? 0 : 1, S_map_enu * T_enu_cam});
    }
    return entries;
  }
  std::vector<TrajectoryEntry> KeyframeTrajectory() const override { return Trajectory(); }
  void FollowPositions(const CameraPositions& positions) override { told.push_back(positions); }

  std::vector<CameraPositions> told;
};

PipelinePositions OncePerSecond(double antenna_down_m) {
  PipelinePositions positions;
  positions.georeference.clock_offset_sigma_s = 0;
  positions.georeference.antenna_down_m = antenna_down_m;
  for (int i = 0; i <= 60; ++i) {
    const Geodetic place = ToGeodetic(OnArc(i), kTakeOff);
    PositionFix fix;
    fix.time_s = i;
    fix.latitude_deg = place.latitude_deg;
    fix.longitude_deg = place.longitude_deg;
    fix.altitude_m = place.altitude_m;
    positions.track.fixes.push_back(fix);
  }
  return positions;
}

TEST(PositionFeed, IsDueEachTimeThatAMapHasGrownByHalf) {
  PositionFeed feed(OncePerSecond(0), false);
  ToldTracker tracker;
  EXPECT_FALSE(feed.IsDue(1, 39));
  EXPECT_TRUE(feed.IsDue(1, 40));
  feed.GiveNow(1, 40, tracker);
  EXPECT_FALSE(feed.IsDue(1, 59));
  EXPECT_TRUE(feed.IsDue(1, 60));
  EXPECT_TRUE(feed.IsDue(2, 40));
}

TEST(PositionFeed, TellsWhereTheCamerasOfTheMapWere) {
  PositionFeed feed(OncePerSecond(0), false);
  ToldTracker tracker;
  feed.GiveNow(1, 40, tracker);
  ASSERT_EQ(tracker.told.size(), 1U);
  const CameraPositions& told = tracker.told.front();
  EXPECT_EQ(told.map_id, 1);
  EXPECT_TRUE(told.has_vertical);
  EXPECT_NEAR(told.S_metric_map.scale() / kUnitOfMap_m, 1, 1e-4);
  ASSERT_EQ(told.positions.size(), 60U);  // the first is of the other map
  for (const CameraPosition& position : told.positions) {
    // East, north, up of the first fix, whose vertical is another one than 200 m away: a
    // centimetre.
    EXPECT_LT((position.p_m - (OnArc(position.time_s) - OnArc(0))).norm(), 0.03);
  }
}

TEST(PositionFeed, TakesTheArmToTheAntennaOff) {
  PositionFeed feed(OncePerSecond(-0.5), false);
  ToldTracker tracker;
  feed.GiveNow(1, 40, tracker);
  ASSERT_EQ(tracker.told.size(), 1U);
  for (const CameraPosition& position : tracker.told.front().positions) {
    EXPECT_NEAR((position.p_m - (OnArc(position.time_s) - OnArc(0))).norm(), 0.5, 0.02);
  }
}

TEST(PositionFeed, IsSilentWhereTheMapHasNoPlace) {
  PositionFeed feed(OncePerSecond(0), false);
  ToldTracker tracker;
  feed.GiveNow(0, 40, tracker);  // half a second long
  feed.GiveNow(7, 40, tracker);  // not there
  EXPECT_TRUE(tracker.told.empty());
}

// The drone writes while it flies.
TEST(PositionFeed, TakesPositionsThatCome) {
  PipelinePositions positions = OncePerSecond(0);
  PositionTrack all = std::move(positions.track);
  positions.track = {};
  PositionFeed feed(std::move(positions), false);
  ToldTracker tracker;
  feed.Give(1, 40, tracker);
  EXPECT_TRUE(tracker.told.empty());
  EXPECT_EQ(feed.place(), nullptr);
  feed.SetTrack(std::move(all));
  feed.Give(1, 60, tracker);
  EXPECT_EQ(tracker.told.size(), 1U);
  ASSERT_NE(feed.place(), nullptr);
  EXPECT_EQ(feed.place()->map_id, 1);
  EXPECT_NEAR(feed.place()->georeference.S_enu_map.scale() / kUnitOfMap_m, 1, 1e-4);
}

TEST(PositionFeed, FindsThePlaceAgainInARunThatGoesOn) {
  PositionFeed before(OncePerSecond(0), false);
  ToldTracker tracker;
  before.Give(1, 40, tracker);
  ASSERT_NE(before.place(), nullptr);
  StateWriter writer("positions", 1, SavedImages::kByIndex);
  before.ExchangeState(writer);
  const std::string state = writer.TakeState();
  PositionFeed after(OncePerSecond(0), false);
  StateReader reader(state, "positions", 1, "here", {});
  after.ExchangeState(reader);
  after.Give(1, 41, tracker);
  EXPECT_EQ(tracker.told.size(), 1U) << "it was told when the run did not go on, either";
  ASSERT_NE(after.place(), nullptr);
  EXPECT_NEAR(after.place()->georeference.S_enu_map.scale() / kUnitOfMap_m, 1, 1e-4);
}

// Live, a thread of its own finds the place, also between the times that the map follows.
TEST(PositionFeed, LivePlacesTheMapWithoutWaiting) {
  PositionFeed feed(OncePerSecond(0), true);
  ToldTracker tracker;
  feed.Give(1, 10, tracker);  // too short to be followed
  EXPECT_EQ(feed.place(), nullptr);
  const auto keyframes_until = [&](std::size_t num_keyframes, const auto& is_done) {
    for (int i = 0; i < 500 && !is_done(); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      feed.Give(1, num_keyframes, tracker);
    }
  };
  keyframes_until(10, [&] { return feed.place() != nullptr; });
  ASSERT_NE(feed.place(), nullptr);
  EXPECT_NEAR(feed.place()->georeference.S_enu_map.scale() / kUnitOfMap_m, 1, 1e-4);
  EXPECT_TRUE(tracker.told.empty());
  keyframes_until(40, [&] { return !tracker.told.empty(); });
  ASSERT_EQ(tracker.told.size(), 1U);
  EXPECT_EQ(tracker.told.front().map_id, 1);
}

}  // namespace
}  // namespace mono3d
