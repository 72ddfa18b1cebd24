// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <cmath>

#include "depth/fine_testing.h"
#include "depth/sgm.h"
#include "reference/depth/fine_winner_reference.h"

namespace mono3d {
namespace {

using reference::FineRange;
using reference::FineVolume;

std::vector<FineVolume> PathsOnDevice(const FineVolume& costs, const std::vector<FineRange>& ranges,
                                      LevelSize size, const SgmOptions& options) {
  const std::size_t bytes = 4 * kFinePlanes * NumFinePixels(size);
  const Buffer paths = MakeBuffer<std::uint8_t>(bytes);
  const Buffer more_paths = MakeBuffer<std::uint8_t>(bytes);
  Recorder recorder(TestDevice());
  const SgmPenalties penalties = UploadPenalties(TestDevice(), options);
  const Buffer range_buffer = FineToBuffer(ranges, size);
  const Buffer cost_buffer = FineToBuffer(costs, size);
  for (std::uint32_t path = 0; path < kNumPaths; ++path) {
    TestKernels().FinePath(recorder, size, penalties, path,
                           {range_buffer, cost_buffer, paths, more_paths});
  }
  recorder.Submit();
  std::vector<FineVolume> result;
  for (std::size_t i = 0; i < kNumPaths; ++i) {
    result.push_back(FineVolumeOf(i < 4 ? paths : more_paths, size, i % 4));
  }
  return result;
}

// A pixel whose only good plane is `plane` on the grid of the level.
std::array<std::uint8_t, 16> OnlyGood(int plane, int first_plane) {
  std::array<std::uint8_t, 16> costs;
  costs.fill(60);
  costs.at(static_cast<std::size_t>(plane - first_plane)) = 0;
  return costs;
}

void ExpectPathsEqualReference(LevelSize size, const SgmOptions& options, std::mt19937& random) {
  const FineVolume costs = RandomFineVolume(size, 255, random);
  const auto ranges = RandomFineRanges(size, random);
  const auto found = PathsOnDevice(costs, ranges, size, options);
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_EQ(found[i],
              reference::FinePath(costs, ranges, static_cast<int>(size.width_px),
                                  static_cast<int>(i), options.p1, JumpPenalties(options)))
        << size.width_px << "x" << size.height_px << ", direction " << i;
  }
}

// SGM^sn (paper, section 3.2): jumps that follow the normals of the level above are free.
TEST(FineSgm, EqualsReferenceBitForBit) {
  std::mt19937 random = SeededByTestName();
  // The kernel divides with floats what the reference divides with whole numbers.
  const SgmOptions other_penalties[] = {{.p1 = 5, .p2 = 130, .min_p2 = 5, .gradient = 1},
                                        {.p1 = 5, .p2 = 126, .min_p2 = 6, .gradient = 7},
                                        {.p1 = 5, .p2 = 129, .min_p2 = 7, .gradient = 255}};
  for (const SgmOptions& options : other_penalties) {
    ExpectPathsEqualReference({17, 33}, options, random);
  }
  for (const LevelSize size :
       {LevelSize{1, 1}, LevelSize{17, 33}, LevelSize{70, 9}, LevelSize{1, 40}}) {
    ExpectPathsEqualReference(size, {}, random);
  }
}

TEST(FineSgm, FindsTheSamePlaneInAnotherRange) {
  // Two pixels, the planes 3 .. 18 and 5 .. 20, both best on plane 9: no penalty in between.
  const std::vector<FineRange> ranges = {{.first_plane = 3, .grey = 0, .jumps = {}},
                                         {.first_plane = 5, .grey = 0, .jumps = {}}};
  const FineVolume costs = {OnlyGood(9, 3), OnlyGood(9, 5)};
  const auto paths = PathsOnDevice(costs, ranges, {2, 1}, {});
  EXPECT_EQ(paths[0][1][9 - 5], 0);
  // Plane 20 is out of the first pixel's range: its own 60 and a jump.
  EXPECT_EQ(paths[0][1][20 - 5], 60 + SgmOptions().p2);
  // Plane 8, next to it: a step.
  EXPECT_EQ(paths[0][1][8 - 5], 60 + SgmOptions().p1);
}

TEST(FineSgm, FollowsTheSurfaceWithoutPenalty) {
  // From left to right the surface comes two planes nearer; from right to left it recedes by two.
  const std::vector<FineRange> ranges(2, {.first_plane = 3, .grey = 0, .jumps = {2, -2}});
  const FineVolume costs = {OnlyGood(9, 3), OnlyGood(11, 3)};
  const auto paths = PathsOnDevice(costs, ranges, {2, 1}, {});
  EXPECT_EQ(paths[0][1][11 - 3], 0);
  EXPECT_EQ(paths[1][0][9 - 3], 0);
  // Plane 9 on the right continues plane 7 on the left, which does not match either.
  EXPECT_EQ(paths[0][1][9 - 3], 60 + 60);
}

TEST(FineSgm, DisjointRangesCostOneJump) {
  const std::vector<FineRange> ranges = {{.first_plane = 0, .grey = 0, .jumps = {}},
                                         {.first_plane = 100, .grey = 0, .jumps = {}}};
  const FineVolume costs = {OnlyGood(4, 0), OnlyGood(110, 100)};
  const auto paths = PathsOnDevice(costs, ranges, {2, 1}, {});
  EXPECT_EQ(paths[0][1][10], SgmOptions().p2);
  EXPECT_EQ(paths[0][1][0], 60 + SgmOptions().p2);
}

void ExpectWinnersEqualReference(LevelSize size, std::uint32_t num_paths, bool sub_plane,
                                 std::mt19937& random) {
  const FineVolume costs = RandomFineVolume(size, 124, random);
  const auto ranges = RandomFineRanges(size, random);
  const SgmOptions options;
  std::vector<FineVolume> paths;
  for (std::uint32_t i = 0; i < num_paths; ++i) {
    paths.push_back(reference::FinePath(costs, ranges, static_cast<int>(size.width_px),
                                        static_cast<int>(i), options.p1, JumpPenalties(options)));
  }
  const FineWinnerParams params{.width_px = size.width_px,
                                .height_px = size.height_px,
                                .max_cost = 100,
                                .min_uniqueness = 0.02f,
                                .inverse_depth = 0.5f,
                                .inverse_depth_step = 0.01f};
  const Buffer inverse_depth = MakeBuffer<float>(size.num_pixels());
  const Buffer uniqueness = MakeBuffer<float>(size.num_pixels());
  Recorder recorder(TestDevice());
  const std::size_t bytes = 4 * kFinePlanes * NumFinePixels(size);
  TestKernels().FineSgm(recorder, UploadPenalties(TestDevice(), options), num_paths, sub_plane,
                        params,
                        {FineToBuffer(ranges, size), FineToBuffer(costs, size),
                         MakeBuffer<std::uint8_t>(bytes), MakeBuffer<std::uint8_t>(bytes)},
                        {inverse_depth, uniqueness});
  recorder.Submit();
  const auto expected = reference::FineWinners(paths, costs, ranges, params);
  const auto depth = FirstOf<float>(inverse_depth, size.num_pixels());
  const auto share = FirstOf<float>(uniqueness, size.num_pixels());
  for (std::size_t i = 0; i < depth.size(); ++i) {
    // Float against double: a few roundings of values near 1.
    const float between_planes = sub_plane ? 0.f : 0.5f * params.inverse_depth_step;
    ASSERT_NEAR(depth[i], expected.inverse_depth[i], between_planes + 1e-6);
    const float plane = (std::abs(depth[i]) - params.inverse_depth) / params.inverse_depth_step;
    ASSERT_TRUE(sub_plane || depth[i] == 0 || std::abs(plane - std::round(plane)) < 1e-3f);
    ASSERT_NEAR(share[i], expected.uniqueness[i], 1e-6);
  }
}

TEST(FineWinner, EqualsReference) {
  std::mt19937 random = SeededByTestName();
  for (const LevelSize size : kSmallSizes) {
    for (const std::uint32_t num_paths : {kFewPaths, kNumPaths}) {
      for (const bool sub_plane : {true, false}) {
        ExpectWinnersEqualReference(size, num_paths, sub_plane, random);
      }
    }
  }
}

}  // namespace
}  // namespace mono3d
