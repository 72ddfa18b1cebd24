// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/new_blocks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "fusion/fusion_scene.h"

namespace mono3d {
namespace {

TEST(SpheresOfNew, SurroundEachBlock) {
  const TrackedMap map = PlaneMap(TestCamera(96, 56), Pose());
  const ViewParams view = MakeViewParams(map, {}, 0, 0);
  std::vector<std::uint32_t> pixels(150);
  std::iota(pixels.begin(), pixels.end(), 96 * 20);
  const auto spheres = SpheresOfNew(view, pixels, Pack(map).depth);
  ASSERT_EQ(spheres.size(), 3U);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const int x = static_cast<int>(pixels[i] % 96);
    const int y = static_cast<int>(pixels[i] / 96);
    const Eigen::Vector3d p = map.depth.at<float>(y, x) * map.camera.Unproject({x, y});
    EXPECT_LE((p - spheres[i / 64].centre).norm(), spheres[i / 64].radius);
  }
  // 64 pixels of a wall 10 su away, 96 to 10 su.
  EXPECT_NEAR(spheres[0].radius, 0.5 * 63 * 10 / 96, 0.1);
}

// Every pixel that another camera sees is in a block that is taken, and blocks that it does not see
// are left out.
TEST(SpheresInView, TakeWhatTheViewSees) {
  const TrackedMap map = PlaneMap(TestCamera(256, 64), Pose());
  const ViewParams view = MakeViewParams(map, {}, 0, 0);
  std::vector<std::uint32_t> pixels(256 * 64);
  std::iota(pixels.begin(), pixels.end(), 0);
  const auto spheres = SpheresOfNew(view, pixels, Pack(map).depth);
  const Similarity S_view_anchor(2, Pose(RotationExp({0.1, -0.5, 0.2}), Eigen::Vector3d(3, 1, 2)));
  const auto taken = SpheresInView(spheres, view, S_view_anchor);
  std::size_t num_seen = 0;
  for (const std::uint32_t pixel : pixels) {
    const int x = static_cast<int>(pixel % 256);
    const int y = static_cast<int>(pixel / 256);
    const Eigen::Vector3d p =
        S_view_anchor * Eigen::Vector3d(map.depth.at<float>(y, x) * map.camera.Unproject({x, y}));
    if (p.z() <= 0 || !map.camera.Contains(map.camera.Project(p))) continue;
    ++num_seen;
    EXPECT_TRUE(std::ranges::binary_search(taken, pixel / 64)) << x << " " << y;
  }
  EXPECT_GT(num_seen, pixels.size() / 10);
  EXPECT_LT(taken.size(), spheres.size() * 9 / 10);
  const Similarity turned_away(1, Pose(RotationExp({0, 3.14, 0}), Eigen::Vector3d::Zero()));
  EXPECT_TRUE(SpheresInView(spheres, view, turned_away).empty());
}

}  // namespace
}  // namespace mono3d
