// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include "fusion/export.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

const std::vector<Similarity> kAtTheOrigin(16);
// Frames of depth maps: every fifth one.
const std::vector<std::uint32_t> kFrames = {0,  5,  10, 15, 20, 25, 30, 35,
                                            40, 45, 50, 55, 60, 65, 70, 75};

Surfels ThreeSurfels() {
  Surfels surfels;
  surfels.position_radius = {{1, 2, 3, 0.5F}, {4, 5, 6, 0.25F}, {7, 8, 9, 0.125F}};
  surfels.normal_weight = {{0, 0, -1, 10}, {0, -1, 0, 0}, {1, 0, 0, 20}};
  // Red 255, green 100.5, blue 0; confirmed twice with confidence 1.5 in all, seen through with
  // confidence 0.5, hidden with 255 / 255; by depth maps 3 to 7.
  surfels.history = {{1023 | 402 << 10, 0xFF040002, 7U << 16 | 3, 384U << 16},
                     {0, 9, 0, 9},
                     {0, 1, 0, 256U << 16}};
  return surfels;
}

// Nine times each, in one place: none stands alone.
constexpr std::size_t kNine = 9;
Surfels Ninefold(const Surfels& surfels) {
  Surfels nine;
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    nine.position_radius.insert(nine.position_radius.end(), kNine, surfels.position_radius[i]);
    nine.normal_weight.insert(nine.normal_weight.end(), kNine, surfels.normal_weight[i]);
    nine.history.insert(nine.history.end(), kNine, surfels.history[i]);
  }
  return nine;
}

TEST(SurfelExport, FillsEveryField) {
  const PointCloud cloud =
      ToPointCloud(Ninefold(ThreeSurfels()), kAtTheOrigin, kFrames, {.min_observations = 2});
  ASSERT_EQ(cloud.size(), kNine);
  EXPECT_EQ(cloud.points[0], Eigen::Vector3f(1, 2, 3));
  EXPECT_EQ(cloud.normals[0], Eigen::Vector3f(0, 0, -1));
  EXPECT_EQ(cloud.colours[0], (std::array<std::uint8_t, 3>{255, 101, 0}));
  EXPECT_EQ(cloud.radii[0], 0.5F);
  EXPECT_FLOAT_EQ(cloud.confidences[0], 1.5F / (1.5F + 0.5F + 1 + 1));
  EXPECT_EQ(cloud.observations[0], 2U);
  EXPECT_EQ(cloud.first_frames, std::vector<std::uint32_t>(kNine, 15));
}

TEST(SurfelExport, LeavesOutRemovedSurfelsAndThoseOfTooFewMaps) {
  const PointCloud all = ToPointCloud(Ninefold(ThreeSurfels()), kAtTheOrigin, kFrames, {});
  ASSERT_EQ(all.size(), 2 * kNine);
  EXPECT_EQ(all.points.front().x(), 1);
  EXPECT_EQ(all.points.back().x(), 7);
  EXPECT_EQ(all.confidences.back(), 0.5F);
  EXPECT_TRUE(ToPointCloud(Ninefold(ThreeSurfels()), kAtTheOrigin, kFrames, {.min_observations = 3})
                  .empty());
}

TEST(SurfelExport, LeavesOutWhatIsNotSure) {
  // Confidences 1.5 / 4 and 1 / 2.
  const Surfels surfels = Ninefold(ThreeSurfels());
  const PointCloud sure =
      ToPointCloud(surfels, kAtTheOrigin, kFrames, {.min_confidence = 0.45, .gap_confidence = 1});
  ASSERT_EQ(sure.size(), kNine);
  EXPECT_EQ(sure.points[0].x(), 7);
  EXPECT_EQ(ToPointCloud(surfels, kAtTheOrigin, kFrames, {.min_confidence = 0.35}).size(),
            2 * kNine);
}

TEST(SurfelExport, KeepsTheSurestShareWhereHardlyAnythingIsSure) {
  // Of confidences 1.5 / 4 and 1 / 2 none reaches what is asked for.
  const Surfels surfels = Ninefold(ThreeSurfels());
  const PointCloud surest =
      ToPointCloud(surfels, kAtTheOrigin, kFrames, {.min_confidence = 0.9, .gap_confidence = 1});
  ASSERT_EQ(surest.size(), kNine);
  EXPECT_EQ(surest.confidences.front(), 0.5F);
  EXPECT_EQ(ToPointCloud(surfels, kAtTheOrigin, kFrames, {.min_confidence = 0.9, .min_share = 0.6})
                .size(),
            2 * kNine);
  EXPECT_TRUE(ToPointCloud(surfels, kAtTheOrigin, kFrames,
                           {.min_confidence = 0.9, .gap_confidence = 1, .min_share = 0})
                  .empty());
}

TEST(SurfelExport, LeavesOutWhatMoreSpeaksAgainstThanFor) {
  Surfels surfels = ThreeSurfels();
  surfels.history[0] = {0, 0x00040001, 0, 127U << 16};  // seen through with 128 of 256
  EXPECT_EQ(ToPointCloud(Ninefold(surfels), kAtTheOrigin, kFrames, {}).size(), kNine);
  EXPECT_EQ(ToPointCloud(surfels, kAtTheOrigin, kFrames, {.min_confidence = 0}).size(),
            2U);  // whatever its confidence
  // By default one observation that expects an error of half a percent is enough.
  surfels.history[0] = {0, 1, 0, 43U << 16};
  EXPECT_EQ(ToPointCloud(Ninefold(surfels), kAtTheOrigin, kFrames, {}).size(), 2 * kNine);
  surfels.history[0][3] = 42U << 16;
  EXPECT_EQ(ToPointCloud(Ninefold(surfels), kAtTheOrigin, kFrames, {.gap_confidence = 1}).size(),
            kNine);
}

// A wall of sure surfels, a radius apart, and a wall of unsure ones that begins on it and goes on
// beside it.
TEST(SurfelExport, FillsGapsWithWhatIsLessSure) {
  constexpr int kColumns = 6;
  constexpr int kRows = 4;
  Surfels surfels;
  const auto add_wall = [&](int first_column, int end_column, float z, std::uint32_t confidence) {
    for (int i = first_column * kRows; i < end_column * kRows; ++i) {
      surfels.position_radius.push_back(
          {static_cast<float>(i / kRows), static_cast<float>(i % kRows), z, 1});
      surfels.normal_weight.push_back({0, 0, -1, 10});
      surfels.history.push_back({0, 1, 0, confidence << 16});
    }
  };
  add_wall(0, kColumns, 9, 256);
  add_wall(3, 12, 9.5, 13);  // an expected error of two percent
  const PointCloud cloud = ToPointCloud(surfels, kAtTheOrigin, kFrames, {});
  // Columns 0 to 5 are taken, and column 6 is 1.1 radii from them.
  ASSERT_EQ(cloud.size(), std::size_t{(kColumns + 5) * kRows});
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const bool is_sure = i < std::size_t{kColumns * kRows};
    EXPECT_EQ(cloud.points[i].z(), is_sure ? 9 : 9.5);
    if (is_sure) continue;
    EXPECT_GE(cloud.points[i].x(), 7);
    EXPECT_LT(cloud.confidences[i], 0.05F);
  }
  EXPECT_EQ(ToPointCloud(surfels, kAtTheOrigin, kFrames, {.gap_confidence = 1}).size(),
            std::size_t{kColumns * kRows});
  // Nor where the same share of the depth is a larger error: farther away.
  Surfels farther = surfels;
  for (std::size_t i = std::size_t{kColumns * kRows}; i < farther.size(); ++i) {
    farther.position_radius[i][3] = 1.2F;
  }
  EXPECT_EQ(ToPointCloud(farther, kAtTheOrigin, kFrames, {}).size(), std::size_t{kColumns * kRows});
  // Below the limit of gaps nothing is exported.
  for (auto& history : surfels.history) history[3] = std::min(history[3], 11U << 16);
  add_wall(0, kColumns, 9, 256);
  EXPECT_EQ(ToPointCloud(surfels, kAtTheOrigin, kFrames, {}).size(), std::size_t{kColumns * kRows});
}

TEST(SurfelExport, LeavesOutWhatStandsAlone) {
  Surfels surfels;
  for (int i = 0; i < 9; ++i) {  // nine pixels of a surface, a radius apart
    surfels.position_radius.push_back({static_cast<float>(i % 3), static_cast<float>(i / 3), 9, 1});
  }
  surfels.position_radius.push_back({1, 1, 5, 1});  // before it
  surfels.normal_weight.assign(10, {0, 0, -1, 10});
  surfels.history.assign(10, {0, 1, 0, 256U << 16});
  const PointCloud cloud = ToPointCloud(surfels, kAtTheOrigin, kFrames, {});
  ASSERT_EQ(cloud.size(), 9U);
  for (const Eigen::Vector3f& point : cloud.points) EXPECT_EQ(point.z(), 9);
  EXPECT_EQ(ToPointCloud(surfels, kAtTheOrigin, kFrames, {.min_confidence = 0}).size(), 10U);
  // Neighbours that are not exported do not count.
  surfels.history[4][3] = 0;
  EXPECT_TRUE(ToPointCloud(surfels, kAtTheOrigin, kFrames, {}).empty());
}

TEST(SurfelExport, HoldsAgainstASingleObservationAloneThatItIsHidden) {
  Surfels surfels = ThreeSurfels();
  surfels.history[0] = {0, 0xFF000001, 0, 128U << 16};  // hidden with 256, for it 128
  EXPECT_EQ(ToPointCloud(Ninefold(surfels), kAtTheOrigin, kFrames, {}).size(), kNine);
  surfels.history[0][1] += 1;  // two agree on it
  EXPECT_EQ(ToPointCloud(Ninefold(surfels), kAtTheOrigin, kFrames, {}).size(), 2 * kNine);
  surfels.history[0][1] += 5U << 16;  // seen through with 160 as well
  EXPECT_EQ(ToPointCloud(Ninefold(surfels), kAtTheOrigin, kFrames, {.min_confidence = 0.01}).size(),
            kNine);
}

TEST(SurfelExport, ThinsToCellsOfRadii) {
  // The median of radii 0.5 and 0.125 is taken upwards: cells of 20 su hold both.
  const Surfels surfels = Ninefold(ThreeSurfels());
  EXPECT_EQ(ToPointCloud(surfels, kAtTheOrigin, kFrames, {.voxel_radii = 40}).size(), 1U);
  EXPECT_EQ(ToPointCloud(surfels, kAtTheOrigin, kFrames, {.voxel_radii = 2}).size(), 2U);
}

TEST(SurfelExport, RefusesOptionsOutOfRange) {
  EXPECT_THROW(ToPointCloud(ThreeSurfels(), kAtTheOrigin, kFrames, {.min_observations = 0}),
               UsageError);
  EXPECT_THROW(ToPointCloud(ThreeSurfels(), kAtTheOrigin, kFrames, {.min_confidence = 1}),
               UsageError);
  EXPECT_THROW(ToPointCloud(ThreeSurfels(), kAtTheOrigin, kFrames, {.min_share = 1.5}), UsageError);
  EXPECT_THROW(ToPointCloud(ThreeSurfels(), kAtTheOrigin, kFrames, {.gap_confidence = -0.1}),
               UsageError);
  EXPECT_THROW(ToPointCloud(ThreeSurfels(), kAtTheOrigin, kFrames, {.voxel_radii = -1}),
               UsageError);
}

}  // namespace
}  // namespace mono3d
