// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include "fusion/fusion_scene.h"

namespace mono3d {
namespace {

std::uint32_t RunGiveWay(StageScene& scene) {
  scene.RunAssociate();
  scene.recorder.Fill(scene.buffers.num_removed, 0);
  scene.kernels.GiveWay(scene.recorder, scene.view, scene.buffers.num_removed, scene.storage,
                        scene.all_blocks);
  scene.recorder.Submit();
  return scene.buffers.num_removed.Download<std::uint32_t>().front();
}

TEST(GiveWay, RemovesWhatLiesOnASurfaceThatADepthMapMatches) {
  const Eigen::Vector3f towards_camera(0, 0, -1);
  Surfels surfels;
  Append(surfels, OneSurfel({0, 0, 10}, towards_camera, 1e4F));  // on the wall
  Append(surfels, OneSurfel({0, 0, 5}, towards_camera, 1e4F));   // before it
  Append(surfels, OneSurfel({0, 0, 30}, towards_camera, 1e4F));  // behind it
  StageScene scene(PlaneMap(TestCamera(90, 50), Pose()), surfels);
  EXPECT_EQ(RunGiveWay(scene), 1U);
  const Surfels found = scene.storage.Download();
  EXPECT_TRUE(IsRemoved(found, 0));
  EXPECT_FALSE(IsRemoved(found, 1));
  EXPECT_FALSE(IsRemoved(found, 2));
}

TEST(GiveWay, EqualsReferenceBitForBit) {
  StageScene scene(96, 56, 8);
  const std::uint32_t num_removed = RunGiveWay(scene);
  Surfels expected = scene.surfels;
  EXPECT_EQ(num_removed, reference::GiveWay(scene.DeviceAssociation(), expected));
  EXPECT_GT(num_removed, 0U);
  const Surfels found = scene.storage.Download();
  EXPECT_EQ(found.history, expected.history);
  EXPECT_EQ(found.normal_weight, expected.normal_weight);
  EXPECT_EQ(found.position_radius, expected.position_radius);
}

}  // namespace
}  // namespace mono3d
