// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include "fusion/fusion_scene.h"
#include "gpu/test_device.h"

namespace mono3d {
namespace {

// Runs everything up to the insertion, without the changes to the surfels that are there.
Surfels RunInsert(StageScene& scene) {
  scene.RunSelectNew();
  const std::vector<std::uint32_t> pixels = ListSelected(scene.DeviceSelected());
  scene.buffers.new_pixels.Upload(std::span<const std::uint32_t>(pixels));
  scene.view.num_new = static_cast<std::uint32_t>(pixels.size());
  const std::uint32_t first = WholeBlocks(scene.storage.size());
  const std::uint32_t end = first + scene.view.num_new;
  scene.storage.Reserve(first + WholeBlocks(scene.view.num_new));
  BlockList added;
  added.SetRange(TestDevice(), first, end);
  scene.kernels.Insert(scene.recorder, scene.view, scene.buffers, scene.storage, added);
  scene.recorder.Submit();
  return scene.storage.DownloadSlots(first, end);
}

TEST(Insert, MakesASurfelOfAPixel) {
  TrackedMap map = PlaneMap(TestCamera(9, 5), Pose());
  map.bgr.at<cv::Vec3b>(2, 5) = cv::Vec3b(10, 20, 30);
  map.confidence = cv::Mat(5, 9, CV_32FC1, cv::Scalar(0.5));
  StageScene scene(map, {});
  scene.view.map_index = 3;
  const Surfels found = RunInsert(scene);
  ASSERT_EQ(found.size(), 45U);
  constexpr std::size_t kPixel = 2 * 9 + 5;  // one to the right of the middle
  const auto& position = found.position_radius[kPixel];
  EXPECT_NEAR(position[0], 10.0 / 9, 1e-5);
  EXPECT_NEAR(position[1], 0, 1e-5);
  EXPECT_NEAR(position[2], 10, 1e-5);
  // The footprint of a pixel is 10 / 9, seen under an angle of cosine 9 / sqrt(82).
  EXPECT_NEAR(position[3], std::sqrt(2.0) * 10 / 9 * std::sqrt(82.0) / 9, 1e-3);
  EXPECT_NEAR(found.normal_weight[kPixel][2], -1, 1e-4);
  EXPECT_NEAR(found.normal_weight[kPixel][3], 0.5 * 18 * 18 / 1e4, 1e-6);
  EXPECT_EQ(found.history[kPixel][0], 30U * 4 | 20U * 4 << 10 | 10U * 4 << 20);
  EXPECT_EQ(found.history[kPixel][1], 1U);
  EXPECT_EQ(found.history[kPixel][2], 0x30003U);
  EXPECT_EQ(found.history[kPixel][3], 128U << 16 | 3U);
}

TEST(Insert, FillsUpTheLastBlockWithSlotsThatCountAsRemoved) {
  StageScene scene(PlaneMap(TestCamera(9, 5), Pose()), {});
  scene.view.map_index = 3;
  Surfels rubbish;
  for (int i = 0; i < 64; ++i) Append(rubbish, OneSurfel({0, 0, 1}, {0, 0, -1}, 1));
  scene.storage.Upload(rubbish);
  scene.storage.Upload({});
  ASSERT_EQ(RunInsert(scene).size(), 45U);
  const Surfels block = scene.storage.DownloadSlots(0, 64);
  for (std::size_t i = 0; i < 64; ++i) {
    EXPECT_EQ(IsRemoved(block, i), i >= 45);
    EXPECT_EQ(AnchorOf(block, i), 3U);
  }
}

TEST(Insert, EqualsReferenceInTheOrderOfThePixels) {
  constexpr float kMaxRelativeError = 1e-5F;
  for (const auto& [width, height] : {std::pair{1, 1}, {17, 33}, {96, 56}}) {
    StageScene scene(width, height, 9);
    const Surfels found = RunInsert(scene);
    Surfels expected;
    reference::Insert(scene.view, scene.packed, scene.DeviceCandidates(), scene.DeviceSelected(),
                      expected);
    ASSERT_EQ(found.size(), expected.size());
    EXPECT_EQ(found.history, expected.history);
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const float depth = std::abs(expected.position_radius[i][2]);
      for (std::size_t k = 0; k < 4; ++k) {
        EXPECT_NEAR(found.position_radius[i][k], expected.position_radius[i][k],
                    kMaxRelativeError * depth);
        EXPECT_NEAR(found.normal_weight[i][k], expected.normal_weight[i][k], kMaxRelativeError);
      }
    }
  }
}

}  // namespace
}  // namespace mono3d
