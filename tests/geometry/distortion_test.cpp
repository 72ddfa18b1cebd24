// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/distortion.h"

#include <gtest/gtest.h>

namespace mono3d {
namespace {

constexpr double kRounding_px = 1e-12;  // px; a few operations in double precision

CameraModel DistortedCamera() {
  return {.width = 80, .height = 60, .fx = 100, .fy = 110, .cx = 39.5, .cy = 29.5};
}

TEST(ProjectDistorted, IsProjectWithoutDistortion) {
  const Eigen::Vector3d p_cam(1, -0.5, 2);
  EXPECT_EQ(ProjectDistorted(DistortedCamera(), p_cam), DistortedCamera().Project(p_cam));
}

TEST(ProjectDistorted, IsWorkedOutByHand) {
  // x = 0.5, y = 1, r2 = 1.25.
  const Eigen::Vector3d p_cam(1, 2, 2);
  CameraModel camera = DistortedCamera();
  camera.distortion = {0.1, 0.2, 0, 0, 0.4};
  // 1 + 0.1 * 1.25 + 0.2 * 1.5625 + 0.4 * 1.953125 = 2.21875
  EXPECT_LT((ProjectDistorted(camera, p_cam) -
             Eigen::Vector2d(100 * 0.5 * 2.21875 + 39.5, 110 * 2.21875 + 29.5))
                .norm(),
            kRounding_px * 1000);
  camera.distortion = {0, 0, 0.01, 0.02, 0};
  // dx = 2 * 0.01 * 0.5 + 0.02 * (1.25 + 0.5), dy = 0.01 * (1.25 + 2) + 2 * 0.02 * 0.5
  EXPECT_LT((ProjectDistorted(camera, p_cam) -
             Eigen::Vector2d(100 * (0.5 + 0.045) + 39.5, 110 * (1 + 0.0525) + 29.5))
                .norm(),
            kRounding_px * 1000);
}

}  // namespace
}  // namespace mono3d
