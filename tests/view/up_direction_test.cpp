// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "view/up_direction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace mono3d::tools {
namespace {

// Camera that looks to `yaw` and down by `pitch`; z of the world is up.
Pose Looking(double yaw, double pitch) {
  const Eigen::Vector3d ahead(std::cos(yaw) * std::cos(pitch), std::sin(yaw) * std::cos(pitch),
                              -std::sin(pitch));
  const Eigen::Vector3d right(std::sin(yaw), -std::cos(yaw), 0);
  Eigen::Matrix3d R;
  R << right, ahead.cross(right), ahead;
  return {R, Eigen::Vector3d::Zero()};
}

double AngleFromUp_deg(const std::vector<Pose>& poses,
                       const std::vector<Eigen::Vector3f>& normals) {
  const double cosine = UpDirection(poses, normals).z();
  return std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / std::numbers::pi;
}

TEST(UpDirection, IsAsTheAxesOfAFinishedRunHaveIt) {
  std::vector<Pose> turning;
  for (int i = 0; i < 20; ++i) turning.push_back(Looking(0.1 * i, 0.8));
  EXPECT_LT(AngleFromUp_deg(turning, {}), 1);
  // On a straight flight the surface decides.
  const std::vector<Pose> straight(20, Looking(0.5, 0.7));
  EXPECT_LT(AngleFromUp_deg(straight, std::vector<Eigen::Vector3f>(50, {0, 0, 1})), 2);
}

TEST(UpDirection, IsTheTopOfTheFirstImageWhereThereIsTooLittle) {
  EXPECT_EQ(UpDirection({}, {}), Eigen::Vector3d(0, -1, 0));
  const std::vector<Pose> two(2, Looking(0.5, 0.7));
  EXPECT_NEAR(AngleFromUp_deg(two, {}), 0.7 * 180 / std::numbers::pi, 1e-6);
}

}  // namespace
}  // namespace mono3d::tools
