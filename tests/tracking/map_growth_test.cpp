// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// A map grows with the ground that was seen, not with the time that was spent over it.

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>

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

// Of the tracker after each of some passes.
class MeanSize {
 public:
  void Add(const MapSize& size) {
    num_keyframes_ += static_cast<double>(size.num_keyframes);
    num_points_ += static_cast<double>(size.num_points);
    num_bytes_ += static_cast<double>(size.num_bytes);
    ++count_;
  }
  double num_keyframes() const { return num_keyframes_ / count_; }
  double num_points() const { return num_points_ / count_; }
  double num_bytes() const { return num_bytes_ / count_; }

 private:
  double num_keyframes_ = 0;
  double num_points_ = 0;
  double num_bytes_ = 0;
  int count_ = 0;
};

TEST(MapGrowth, HoveringOverTheSameGroundAddsNextToNothing) {
  // Of nine keyframes one comes and goes with where they stand in a pass. Of the bytes, the poses
  // of all frames are 10 %. A map that keeps what nobody sees again grows by a half.
  constexpr double kMaxGrowth = 0.15;
  constexpr double kMaxGrowthOfBytes = 0.25;
  constexpr std::size_t kNumImages = 10;  // a strip of a quarter of the flying height
  constexpr std::size_t kNumFirst = 4;    // times there and back, in which the map becomes complete
  constexpr std::size_t kNumAll = 40;
  constexpr std::int64_t kMaxUntracked = 10;  // before the start
  const Sequence flight = FlyOver(TexturedGround(true), kNumImages);
  TrackerOptions options;
  options.features.num_features = 300;
  const std::unique_ptr<Tracker> tracker = CreateTracker(options);
  std::int64_t index = 0;
  MeanSize first;
  MeanSize last;
  for (std::size_t pass = 0; pass < kNumAll; ++pass) {
    for (std::size_t i = 0; i < 2 * kNumImages - 2; ++i) {
      Frame frame = flight.frames[i < kNumImages ? i : 2 * kNumImages - 2 - i];
      frame.index = index;
      frame.timestamp_s = 0.1 * static_cast<double>(index++);
      ASSERT_TRUE(tracker->Track(frame).T_world_cam || index < kMaxUntracked);
    }
    if (pass + 1 == kNumFirst) first.Add(SizeOf(*tracker));
    if (pass >= kNumAll / 2) last.Add(SizeOf(*tracker));
  }
  EXPECT_LT(last.num_keyframes(), (1 + kMaxGrowth) * first.num_keyframes());
  EXPECT_LT(last.num_points(), (1 + kMaxGrowth) * first.num_points());
  EXPECT_LT(last.num_bytes(), (1 + kMaxGrowthOfBytes) * first.num_bytes());
}

}  // namespace
}  // namespace mono3d::tracking
