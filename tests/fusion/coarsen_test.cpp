// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/coarsen.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fusion/fusion_scene.h"
#include "fusion/storage.h"
#include "gpu/test_device.h"
#include "mono3d/fusion/surfel_map.h"

namespace mono3d {
namespace {

constexpr int kWidth = 96;
constexpr int kHeight = 64;

// A wall 10 su away as a camera at x su to the side sees it.
TrackedMap WallMap(double x_su) {
  return PlaneMap(TestCamera(kWidth, kHeight),
                  Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(x_su, 0, 0)));
}

TEST(Coarsened, KeepsTheStrongestOfACell) {
  const Eigen::Vector3f normal(0, 0, -1);
  Surfels surfels;  // radius 1: cells of 1.41 su
  Append(surfels, OneSurfel({0.1F, 0.1F, 0.1F}, normal, 5));
  Append(surfels, OneSurfel({1.3F, 0.1F, 0.1F}, normal, 7));
  Append(surfels, OneSurfel({1.5F, 0.1F, 0.1F}, normal, 1));
  Append(surfels, OneSurfel({0.2F, 0.1F, 0.1F}, normal, 0));  // removed
  Append(surfels, OneSurfel({0.3F, 0.1F, 0.1F}, normal, 2));
  surfels.position_radius[4][3] = 0.25F;  // smaller: a grid of its own
  const Surfels coarse = Coarsened(surfels, std::vector<Similarity>(1));
  ASSERT_EQ(coarse.size(), 3U);
  EXPECT_EQ(coarse.position_radius[0], (Surfels::Float4{1.3F, 0.1F, 0.1F, 2}));
  EXPECT_EQ(coarse.position_radius[1], (Surfels::Float4{1.5F, 0.1F, 0.1F, 2}));
  EXPECT_EQ(coarse.position_radius[2], (Surfels::Float4{0.3F, 0.1F, 0.1F, 0.5F}));
  EXPECT_EQ(coarse.normal_weight[0][3], 7);
}

// The same surfels in another unit, and in another frame, are the same.
TEST(Coarsened, LooksAtTheWorld) {
  const Eigen::Vector3f normal(0, 0, -1);
  Surfels surfels;
  Append(surfels, OneSurfel({0.1F, 0.1F, 0.1F}, normal, 5));
  Append(surfels, InUnit(OneSurfel({-3.9F, 0.3F, 0.1F}, normal, 6), 2));
  surfels.history[1][3] |= 1;
  const Similarity S_world_other(0.5,
                                 Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(4, 0, 0)));
  const Surfels coarse = Coarsened(surfels, std::vector<Similarity>{Similarity(), S_world_other});
  ASSERT_EQ(coarse.size(), 1U);
  EXPECT_EQ(AnchorOf(coarse, 0), 1U);
  EXPECT_EQ(coarse.position_radius[0][3], 4);  // twice its radius of 2 units
}

TEST(KeepEveryPixel, LeavesEverySecondRowAndColumn) {
  std::vector<std::uint32_t> mask(2, 0xFFFFFFFFU);  // 8 pixels a row, 8 rows
  KeepEveryPixel(2, 8, mask);
  EXPECT_THAT(mask, ::testing::ElementsAre(0x00550055U, 0x00550055U));
}

TEST(SurfelMap, BecomesCoarserWhenItIsFull) {
  constexpr int kNumMaps = 5;
  SurfelMapOptions options;
  options.max_surfels = kWidth * kHeight * 2;
  const auto map = CreateTrackedModel(options);
  for (int i = 0; i < kNumMaps; ++i) {
    const FusionResult result = map->Integrate(WallMap(11.0 * i));  // side by side
    EXPECT_EQ(result.status, FusionStatus::kFused) << result.reason;
    EXPECT_LE(result.num_surfels, options.max_surfels);
  }
  // All of the wall is there still: each square of 1 su, of about 10 x 10 pixels, has surfels.
  std::map<std::pair<int, int>, int> squares;
  for (const auto& p : map->Export(1).points) {
    EXPECT_NEAR(p.z(), 10, 1e-3);
    ++squares[{static_cast<int>(std::floor(p.x())), static_cast<int>(std::floor(p.y()))}];
  }
  int num_empty = 0;
  for (int i = 0; i < kNumMaps; ++i) {
    for (int x = -4; x < 4; ++x) {
      for (int y = -3; y < 3; ++y) num_empty += squares.contains({11 * i + x, y}) ? 0 : 1;
    }
  }
  EXPECT_EQ(num_empty, 0);
  // The same again adds hardly anything: what is twice as far apart covers twice as much.
  EXPECT_LT(map->Integrate(WallMap(11.0 * (kNumMaps - 1))).num_inserted, kWidth * kHeight / 100);
}

TEST(SurfelStorage, NeedsNoMoreThan64BytesASurfel) {
  const SurfelStorage storage(TestDevice(), 100'000);
  const std::size_t bytes = storage.position_radius().size_bytes() +
                            storage.normal_weight().size_bytes() + storage.history().size_bytes() +
                            storage.association().size_bytes();
  const std::size_t num_surfels = storage.position_radius().size_bytes() / 16;
  EXPECT_EQ(bytes, 52 * num_surfels);
}

}  // namespace
}  // namespace mono3d
