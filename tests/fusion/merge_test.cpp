// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include <cmath>

#include "fusion/fusion_scene.h"
#include "reference/fusion/view_reference.h"

namespace mono3d {
namespace {

void RunMerge(StageScene& scene) {
  scene.RunAssociate();
  scene.recorder.Fill(scene.buffers.num_removed, 0);
  scene.kernels.Merge(scene.recorder, scene.view, scene.anchor_table, scene.buffers,
                      scene.buffers.num_removed, scene.storage, scene.all_blocks);
  scene.recorder.Submit();
}

TEST(Merge, AveragesByWeight) {
  // Matching noise of half a pixel at 10 su with f b = 9: information on depth 1 / (100 / 18)^2.
  constexpr float kWeight = 18.0F * 18 / 1e4F;
  // The surfel is as sure in inverse depth, at 12 su: the mean of 1/12 and 1/10 is 1/10.909.
  const float surfel_weight = kWeight * std::pow(10.0F / 12, 4.0F);
  const Eigen::Vector3f slanted(0, -0.6F, -0.8F);
  Surfels surfels = OneSurfel({0, 0, 12}, slanted, surfel_weight);
  surfels.position_radius[0][3] = 100;
  surfels.history[0] = {200 * 4, 0x20003, 0x10001, (256U << 16) | 7};
  StageScene scene(PlaneMap(TestCamera(9, 5), Pose()), surfels);
  scene.view.map_index = 5;
  RunMerge(scene);
  const Surfels merged = scene.storage.Download();

  EXPECT_NEAR(merged.position_radius[0][0], 0, 1e-5);
  EXPECT_NEAR(merged.position_radius[0][1], 0, 1e-5);
  EXPECT_NEAR(merged.position_radius[0][2], 2 / (1.0 / 12 + 1.0 / 10), 1e-3);
  EXPECT_NEAR(merged.position_radius[0][3], std::sqrt(2.0) * 10 / 9, 1e-4);  // the finer one
  EXPECT_NEAR(merged.normal_weight[0][3], kWeight + surfel_weight, 1e-6);
  const float share = kWeight / (kWeight + surfel_weight);
  const Eigen::Vector3f n =
      ((1 - share) * slanted + share * Eigen::Vector3f(0, 0, -1)).normalized();
  EXPECT_NEAR(merged.normal_weight[0][1], n.y(), 1e-3);
  EXPECT_NEAR(merged.normal_weight[0][2], n.z(), 1e-3);
  // Red from 800 towards 400, green and blue from 0; one more for it, two against it as before;
  // last seen by map 5; anchored to 7 still, one full confidence more.
  const float red = 800 * (1 - share) + 400 * share;
  EXPECT_NEAR(merged.history[0][0] & 0x3FFU, red, 1);
  EXPECT_NEAR(merged.history[0][0] >> 10 & 0x3FFU, 400 * share, 1);
  EXPECT_EQ(merged.history[0][1], 0x20004U);
  EXPECT_EQ(merged.history[0][2], 0x50001U);
  EXPECT_EQ(merged.history[0][3], (512U << 16) | 7U);
}

TEST(Merge, LeavesClippedChannelsOut) {
  const auto red_of = [](std::uint32_t surfel_red, int image_red) {
    Surfels surfels = OneSurfel({0, 0, 10}, {0, 0, -1}, 0.01F);
    surfels.history[0][0] = surfel_red;
    TrackedMap map = PlaneMap(TestCamera(9, 5), Pose());
    map.bgr.setTo(cv::Scalar(100, 100, image_red));
    StageScene scene(map, surfels);
    RunMerge(scene);
    return scene.storage.Download().history[0][0] & 0x3FFU;
  };
  EXPECT_EQ(red_of(800, 255), 800U);
  EXPECT_EQ(red_of(1020, 200), 800U);
  EXPECT_EQ(red_of(1020, 255), 1020U);
  EXPECT_LT(red_of(800, 254), 1016U);
  EXPECT_GT(red_of(800, 254), 800U);
}

TEST(Merge, CountsPerBlockWhatIsConfirmed) {
  StageScene scene(48, 32, 6);
  RunMerge(scene);
  const std::vector<std::uint32_t> association = scene.DeviceAssociation();
  std::vector<std::uint32_t> expected(scene.all_blocks.size());
  for (std::size_t i = 0; i < association.size(); ++i) {
    expected[i / kSurfelsPerBlock] += IsPixel(association[i]) ? 1 : 0;
  }
  std::vector<std::uint32_t> found(expected.size());
  scene.storage.num_confirmed().Download(std::span(found));
  EXPECT_EQ(found, expected);

  // All had been seen once before.
  double share = 0;
  double own_share = 0;
  for (const std::uint32_t count : expected) {
    share += count / 64.0 / static_cast<double>(expected.size());
    own_share += 1 / (1 + count / 64.0) / static_cast<double>(expected.size());
  }
  const auto confirmed = scene.storage.TakeConfirmed(scene.all_blocks.numbers());
  ASSERT_EQ(confirmed.size(), 1U);
  EXPECT_EQ(confirmed[0].anchor, 0U);
  EXPECT_NEAR(confirmed[0].share, share, 1e-6);
  EXPECT_NEAR(confirmed[0].own_share, own_share, 1e-6);
}

TEST(Merge, MovesSurfelsAlongTheirRayOnly) {
  constexpr float kMaxError = 1e-4F;
  StageScene scene(48, 32, 6);
  RunMerge(scene);
  const Surfels merged = scene.storage.Download();
  const Eigen::Vector3f centre =
      reference::CameraFromAnchor(scene.anchors.front()).PointToAnchor({0, 0, 0});
  std::size_t num_moved = 0;
  for (std::size_t i = 0; i < merged.size(); ++i) {
    const auto& a = scene.surfels.position_radius[i];
    const auto& b = merged.position_radius[i];
    const Eigen::Vector3f before = Eigen::Vector3f(a[0], a[1], a[2]) - centre;
    const Eigen::Vector3f after = Eigen::Vector3f(b[0], b[1], b[2]) - centre;
    EXPECT_LT(before.normalized().cross(after.normalized()).norm(), kMaxError);
    num_moved += before == after ? 0 : 1;
  }
  EXPECT_GT(num_moved, merged.size() / 2);
}

TEST(Merge, EqualsReference) {
  constexpr float kMaxRelativeError = 1e-4F;  // some 20 roundings of 6e-8, a normal times a cosine
  for (const auto& [width, height] : {std::pair{1, 1}, {17, 33}, {96, 56}}) {
    StageScene scene(width, height, 7);
    RunMerge(scene);
    const Surfels found = scene.storage.Download();
    Surfels expected = scene.surfels;
    reference::Merge(scene.view, scene.anchors, scene.packed, scene.DeviceCandidates(),
                     scene.DeviceAssociation(), expected);
    const std::uint32_t num_removed =
        reference::ClearFreeSpace(scene.view, scene.DeviceAssociation(), expected);
    EXPECT_EQ(scene.buffers.num_removed.Download<std::uint32_t>().front(), num_removed);
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const float depth = std::abs(expected.position_radius[i][2]);
      for (std::size_t k = 0; k < 4; ++k) {
        EXPECT_NEAR(found.position_radius[i][k], expected.position_radius[i][k],
                    kMaxRelativeError * depth);
        const float scale = k < 3 ? 1 : expected.normal_weight[i][3];
        EXPECT_NEAR(found.normal_weight[i][k], expected.normal_weight[i][k],
                    kMaxRelativeError * scale);
      }
      for (unsigned shift = 0; shift < 30; shift += 10) {
        // Rounding may tip over: one step of 1023.
        EXPECT_NEAR(found.history[i][0] >> shift & 0x3FFU, expected.history[i][0] >> shift & 0x3FFU,
                    1);
      }
      for (const std::size_t k : {1U, 2U, 3U}) {
        EXPECT_EQ(found.history[i][k], expected.history[i][k]);
      }
    }
  }
}

}  // namespace
}  // namespace mono3d
