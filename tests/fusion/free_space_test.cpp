// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include "fusion/fusion_scene.h"

namespace mono3d {
namespace {

const Eigen::Vector3f kTowardsCamera(0, 0, -1);

std::uint32_t RunFreeSpace(StageScene& scene) {
  scene.RunAssociate();
  scene.recorder.Fill(scene.buffers.num_removed, 0);
  scene.kernels.ClearFreeSpace(scene.recorder, scene.view, scene.buffers.num_removed, scene.storage,
                               scene.all_blocks);
  scene.recorder.Submit();
  return scene.buffers.num_removed.Download<std::uint32_t>().front();
}

// A surfel before or behind a wall 10 su away, that `num_maps` have seen with a sum of confidences.
Surfels SeenSurfel(float z, std::uint32_t num_maps, double confidence_for, double seen_through = 0,
                   double hidden = 0) {
  Surfels surfel = OneSurfel({0, 0, z}, kTowardsCamera, 1e4F);
  surfel.history[0][1] = num_maps | static_cast<std::uint32_t>(8 * seen_through) << 16 |
                         static_cast<std::uint32_t>(255 * hidden) << 24;
  surfel.history[0][3] = static_cast<std::uint32_t>(256 * confidence_for) << 16;
  return surfel;
}

// The wall as a depth map sees it with confidence 1/2.
TrackedMap Wall() {
  TrackedMap map = PlaneMap(TestCamera(90, 50), Pose());
  map.confidence = cv::Mat(50, 90, CV_32FC1, cv::Scalar(0.5));
  return map;
}

TEST(FreeSpace, RemovesASurfelWhenAsMuchSpeaksAgainstItAsForIt) {
  Surfels surfels;
  Append(surfels, SeenSurfel(1, 3, 1.5));       // 1.5 for it, 0.5 against it now
  Append(surfels, SeenSurfel(1, 3, 1.5, 0.5));  // 1 now
  Append(surfels, SeenSurfel(1, 3, 1.5, 1));    // 1.5 now
  Append(surfels, SeenSurfel(10, 3, 1.5, 1));   // on the wall
  StageScene scene(Wall(), surfels);
  EXPECT_EQ(RunFreeSpace(scene), 1U);
  const Surfels found = scene.storage.Download();
  EXPECT_EQ(found.history[0][1], 0x40003U);
  EXPECT_EQ(found.history[1][1], 0x80003U);
  EXPECT_FALSE(IsRemoved(found, 0));
  EXPECT_FALSE(IsRemoved(found, 1));
  EXPECT_TRUE(IsRemoved(found, 2));
  EXPECT_EQ(found.history[3], surfels.history[3]);
  EXPECT_FALSE(IsRemoved(found, 3));
}

TEST(FreeSpace, RemovesAHiddenSurfelThatOneMapAloneHasSeen) {
  Surfels surfels;
  Append(surfels, SeenSurfel(30, 1, 0.9));          // 0.5 against it now
  Append(surfels, SeenSurfel(30, 1, 0.9, 0, 0.5));  // 1 now
  Append(surfels, SeenSurfel(30, 2, 0.9, 0, 0.5));  // two maps agree on it
  Append(surfels, SeenSurfel(30, 2, 0.9, 0, 1));    // things hide each other: one, however often
  StageScene scene(Wall(), surfels);
  EXPECT_EQ(RunFreeSpace(scene), 1U);
  const Surfels found = scene.storage.Download();
  EXPECT_FALSE(IsRemoved(found, 0));
  EXPECT_EQ(found.history[0][1], 128U << 24 | 1U);
  EXPECT_TRUE(IsRemoved(found, 1));
  EXPECT_FALSE(IsRemoved(found, 2));
  EXPECT_FALSE(IsRemoved(found, 3));
  EXPECT_EQ(found.history[2][1], 255U << 24 | 2U);
  EXPECT_EQ(found.history[3][1], 255U << 24 | 2U);
}

TEST(FreeSpace, LeavesSurfelsBeforeTheFirstAlone) {
  Surfels surfels;
  Append(surfels, SeenSurfel(1, 1, 0.25));
  Append(surfels, SeenSurfel(1, 1, 0.25));
  StageScene scene(Wall(), surfels);
  scene.view.first_surfel = 1;
  EXPECT_EQ(RunFreeSpace(scene), 1U);
  EXPECT_FALSE(IsRemoved(scene.storage.Download(), 0));
  EXPECT_TRUE(IsRemoved(scene.storage.Download(), 1));
}

TEST(FreeSpace, RemovesNothingThatAMapOfThePastSpeaksAgainst) {
  StageScene scene(Wall(), SeenSurfel(1, 1, 0.25));
  scene.view.is_past = 1;
  EXPECT_EQ(RunFreeSpace(scene), 0U);
  EXPECT_EQ(scene.storage.Download().history[0][1], 0x40001U);
  EXPECT_FALSE(IsRemoved(scene.storage.Download(), 0));
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
