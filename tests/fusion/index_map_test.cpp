// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include <bit>

#include "fusion/fusion_scene.h"
#include "gpu/test_device.h"

namespace mono3d {
namespace {

const Eigen::Vector3f kTowardsCamera(0, 0, -1);

TEST(IndexMap, KeepsTheNearestAndOfEqualsTheFirst) {
  // Uncertain enough to be no contradiction to the map.
  constexpr float kWeight = 1e-4F;
  Surfels surfels;
  Append(surfels, OneSurfel({0.1F, 0.1F, 11}, kTowardsCamera, kWeight));
  Append(surfels, OneSurfel({0.1F, 0.1F, 10}, kTowardsCamera, kWeight));
  Append(surfels, OneSurfel({0.1F, 0.1F, 10}, kTowardsCamera, kWeight));
  Append(surfels, OneSurfel({0.1F, 0.1F, 9}, -kTowardsCamera, kWeight));  // faces away
  Append(surfels, OneSurfel({0.1F, 0.1F, 8}, kTowardsCamera, 0));         // removed
  StageScene scene(PlaneMap(TestCamera(9, 5), Pose()), surfels);
  scene.RunIndexMap();
  const auto index_map = scene.DeviceIndexMap();
  ASSERT_EQ(index_map.size(), 18U * 10U);
  // The middle pixel (4, 2) has the cells (8, 4) to (9, 5); right and below its centre is the last.
  for (std::size_t cell = 0; cell < index_map.size(); ++cell) {
    if (cell == 5 * 18 + 9) {
      EXPECT_EQ(index_map[cell].surfel, 1U);
      EXPECT_EQ(index_map[cell].depth_bits, std::bit_cast<std::uint32_t>(10.0F));
    } else {
      EXPECT_EQ(index_map[cell], reference::IndexCell{});
    }
  }
}

TEST(IndexMap, LeavesOutWhatIsSeenThrough) {
  StageScene scene(PlaneMap(TestCamera(90, 50), Pose()),
                   OneSurfel({0, 0, 1}, kTowardsCamera, 1e4F));
  scene.RunIndexMap();
  ASSERT_EQ(scene.DeviceAssociation().front(), kSeenThrough | 255U);
  const auto index_map = scene.DeviceIndexMap();
  EXPECT_EQ(index_map, std::vector<reference::IndexCell>(index_map.size()));
}

TEST(IndexMap, EqualsReferenceBitForBit) {
  for (const auto& [width, height] : {std::pair{1, 1}, {17, 33}, {96, 56}}) {
    StageScene scene(width, height, 3);
    scene.RunIndexMap();
    const auto expected = reference::DrawIndexMap(scene.view, scene.anchors, scene.surfels,
                                                  scene.DeviceAssociation());
    EXPECT_EQ(scene.DeviceIndexMap(), expected) << width << "x" << height;
  }
}

TEST(IndexMap, IsTheSameInTwoPassesOf32Bits) {
  StageScene scene(96, 56, 4);
  scene.RunIndexMap();
  const auto in_one_pass = scene.DeviceIndexMap();
  ASSERT_NE(in_one_pass, std::vector<reference::IndexCell>(in_one_pass.size()));
  const FusionKernels without_int64(TestDevice(), false);
  without_int64.DrawIndexMap(scene.recorder, scene.view, scene.anchor_table,
                             scene.buffers.index_map, scene.storage, scene.all_blocks);
  scene.recorder.Submit();
  EXPECT_EQ(scene.DeviceIndexMap(), in_one_pass);
}

TEST(IndexMap, IsTheSameInOnePassWithTheAssociation) {
  StageScene scene(96, 56, 5);
  scene.RunIndexMap();
  const auto association = scene.DeviceAssociation();
  const auto index_map = scene.DeviceIndexMap();
  ASSERT_NE(index_map, std::vector<reference::IndexCell>(index_map.size()));
  for (const bool allow_int64_atomics : {true, false}) {
    const FusionKernels kernels(TestDevice(), allow_int64_atomics);
    scene.recorder.Fill(scene.storage.association(), 0);
    kernels.AssociateAndDraw(scene.recorder, scene.view, scene.anchor_table, scene.buffers,
                             scene.buffers.index_map, scene.storage, scene.all_blocks);
    scene.recorder.Submit();
    EXPECT_EQ(scene.DeviceAssociation(), association);
    EXPECT_EQ(scene.DeviceIndexMap(), index_map);
  }
}

}  // namespace
}  // namespace mono3d
