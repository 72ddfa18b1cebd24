// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// A map grows with the ground that was seen, not with the time that was spent over it.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "mono3d/tracking/tracker.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

struct MapSize {
  std::size_t num_keyframes = 0;
  std::size_t num_points = 0;
  std::size_t num_bytes = 0;  // as saved, culled keyframes and the frames' poses included
};

MapSize SizeOf(const Tracker& tracker) {
  const SparseModel sparse = tracker.Sparse(0);
  return {sparse.images.size(), sparse.points.size(), tracker.SaveMap().size()};
}

TEST(MapGrowth, HoveringOverTheSameGroundAddsNextToNothing) {
  // Every frame's pose is kept, 1 %; where keyframes stand varies from pass to pass.
  constexpr double kMaxGrowth = 0.05;
  constexpr std::size_t kNumImages = 24;  // a strip of 60 % of the flying height
  constexpr std::size_t kNumFirst = 4;    // times there and back, in which the map becomes complete
  constexpr std::size_t kNumAll = 10;
  constexpr std::int64_t kMaxUntracked = 10;  // before the start
  const Sequence flight = FlyOver(TexturedGround(true), kNumImages);
  const std::unique_ptr<Tracker> tracker = CreateTracker();
  std::int64_t index = 0;
  MapSize first;
  for (std::size_t pass = 0; pass < kNumAll; ++pass) {
    for (std::size_t i = 1; i < 2 * kNumImages - 1; ++i) {
      Frame frame = flight.frames[i < kNumImages ? i : 2 * kNumImages - 2 - i];
      frame.index = index;
      frame.timestamp_s = 0.1 * static_cast<double>(index++);
      ASSERT_TRUE(tracker->Track(frame).T_world_cam || index < kMaxUntracked);
    }
    if (pass + 1 == kNumFirst) first = SizeOf(*tracker);
  }
  const MapSize last = SizeOf(*tracker);
  const auto expect_little = [&](std::size_t before, std::size_t after) {
    EXPECT_LT(static_cast<double>(after), (1 + kMaxGrowth) * static_cast<double>(before));
  };
  expect_little(first.num_keyframes, last.num_keyframes);
  expect_little(first.num_points, last.num_points);
  expect_little(first.num_bytes, last.num_bytes);
}

}  // namespace
}  // namespace mono3d::tracking
