// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include "fusion/fusion_scene.h"

namespace mono3d {
namespace {

const Eigen::Vector3f kTowardsCamera(0, 0, -1);

TEST(ListSelected, NumbersTheBitsThatAreSet) {
  const std::vector<std::uint32_t> mask = {0b1011, 0, 0x80000001};
  EXPECT_EQ(ListSelected(mask), (std::vector<std::uint32_t>{0, 1, 3, 64, 95}));
}

TEST(ListSelected, TakesNothingForNothing) { EXPECT_TRUE(ListSelected({}).empty()); }

TEST(SelectNew, TakesEveryPixelForAnEmptyModel) {
  TrackedMap map = PlaneMap(TestCamera(9, 5), Pose());
  map.depth.at<float>(0, 3) = 0;
  StageScene scene(map, {});
  scene.RunSelectNew();
  EXPECT_EQ(scene.DeviceSelected(), (std::vector<std::uint32_t>{0xFFFFFFF7, 0x1FFF}));
}

// The pixels of a 9x5 map of a wall that one surfel covers.
std::vector<int> CoveredBy(const Surfels& surfel) {
  TrackedMap map = PlaneMap(TestCamera(9, 5), Pose());
  map.depth_sigma_per_square_depth = 1.0 / 900;  // infinity is not within three sigmas
  StageScene scene(map, surfel);
  scene.RunSelectNew();
  const auto selected = scene.DeviceSelected();
  std::vector<int> covered;
  for (int i = 0; i < 45; ++i) {
    if ((selected[static_cast<std::size_t>(i / 32)] >> (i % 32) & 1U) == 0) covered.push_back(i);
  }
  return covered;
}

TEST(SelectNew, LeavesOutPixelsWithinOnePixelOfASurfel) {
  constexpr float kWeight = 0.03F;  // as sure as the map
  // In the lower right quarter of pixel (4, 2): the neighbours there are within one pixel.
  EXPECT_EQ(CoveredBy(OneSurfel({0.1F, 0.1F, 10}, kTowardsCamera, kWeight)),
            (std::vector<int>{22, 23, 31, 32}));
  EXPECT_EQ(CoveredBy(OneSurfel({-0.1F, -0.1F, 10}, kTowardsCamera, kWeight)),
            (std::vector<int>{12, 13, 21, 22}));
}

TEST(SelectNew, LooksPastSurfelsOfOtherSurfaces) {
  constexpr float kSure = 1e6F;
  EXPECT_EQ(CoveredBy(OneSurfel({0.1F, 0.1F, 1000}, kTowardsCamera, kSure)).size(), 0U);
  EXPECT_EQ(CoveredBy(OneSurfel({0.1F, 0.1F, 10}, {-0.96F, 0, -0.28F}, kSure)).size(), 0U);
  EXPECT_EQ(CoveredBy(OneSurfel({0.1F, 0.1F, 10}, -kTowardsCamera, kSure)).size(), 0U);
}

TEST(SelectNew, EqualsReferenceBitForBit) {
  for (const auto& [width, height] : {std::pair{1, 1}, {17, 33}, {96, 56}}) {
    StageScene scene(width, height, 5);
    scene.RunSelectNew();
    const auto expected =
        reference::SelectNew(scene.view, scene.anchors, scene.packed, scene.DeviceCandidates(),
                             scene.DeviceIndexMap(), scene.surfels);
    EXPECT_EQ(scene.DeviceSelected(), expected) << width << "x" << height;
    const std::size_t num_selected = ListSelected(expected).size();
    if (width == 96) {
      EXPECT_GT(num_selected, 0U);
      EXPECT_LT(num_selected, static_cast<std::size_t>(scene.packed.blocks.num_candidates) / 2);
    }
  }
}

}  // namespace
}  // namespace mono3d
