// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include "fusion/fusion_scene.h"

namespace mono3d {
namespace {

std::uint32_t RunFreeSpace(StageScene& scene) {
  scene.RunAssociate();
  scene.stages.ClearFreeSpace(scene.recorder, scene.view, scene.buffers, scene.storage);
  scene.recorder.Submit();
  return scene.buffers.num_removed.Download<std::uint32_t>().front();
}

TEST(FreeSpace, RemovesASurfelWithAsManyAgainstItAsForIt) {
  const Eigen::Vector3f towards_camera(0, 0, -1);
  Surfels surfels;
  Append(surfels, OneSurfel({0, 0, 1}, towards_camera, 1e4F));
  Append(surfels, OneSurfel({0, 0, 1}, towards_camera, 1e4F));
  Append(surfels, OneSurfel({0, 0, 10}, towards_camera, 1e4F));  // on the wall
  surfels.history[0][1] = 0x10003;                               // for it 3, against it 1 and now 2
  surfels.history[1][1] = 0x20003;                               // for it 3, against it 2 and now 3
  StageScene scene(PlaneMap(TestCamera(90, 50), Pose()), surfels);
  EXPECT_EQ(RunFreeSpace(scene), 1U);
  const Surfels found = scene.storage.Download();
  EXPECT_EQ(found.history[0][1], 0x20003U);
  EXPECT_FALSE(IsRemoved(found, 0));
  EXPECT_TRUE(IsRemoved(found, 1));
  EXPECT_EQ(found.history[2], surfels.history[2]);
  EXPECT_FALSE(IsRemoved(found, 2));
}

TEST(FreeSpace, EqualsReferenceBitForBit) {
  StageScene scene(96, 56, 8);
  const std::uint32_t num_removed = RunFreeSpace(scene);
  Surfels expected = scene.surfels;
  EXPECT_EQ(num_removed,
            reference::ClearFreeSpace(scene.view, scene.DeviceAssociation(), expected));
  EXPECT_GT(num_removed, 0U);
  const Surfels found = scene.storage.Download();
  EXPECT_EQ(found.history, expected.history);
  EXPECT_EQ(found.normal_weight, expected.normal_weight);
  EXPECT_EQ(found.position_radius, expected.position_radius);
}

}  // namespace
}  // namespace mono3d
