// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "view/up_direction.h"

#include <gtest/gtest.h>

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

double AngleFromUp_deg(const std::vector<Pose>& poses, const Eigen::Vector3d& mean_normal) {
  const double cosine = UpDirection(poses, mean_normal).z();
  return std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / std::numbers::pi;
}

TEST(UpDirection, IsAcrossTheCamerasThatTurn) {
  std::vector<Pose> poses;
  for (int i = 0; i < 20; ++i) poses.push_back(Looking(0.1 * i, 0.8));
  EXPECT_LT(AngleFromUp_deg(poses, {0.3, 0, 0.6}), 5);
  EXPECT_LT(AngleFromUp_deg(poses, Eigen::Vector3d::Zero()), 1);
}

TEST(UpDirection, IsThatOfTheSurfaceOnAStraightFlight) {
  const std::vector<Pose> level(20, Looking(0.5, 0.7)), down(20, Looking(0.5, 1.57));
  EXPECT_LT(AngleFromUp_deg(level, {0, 0, 0.8}), 1);
  EXPECT_LT(AngleFromUp_deg(down, {0, 0, 0.8}), 1);
}

TEST(UpDirection, IsThatOfTheFirstCameraWithoutAny) {
  EXPECT_EQ(UpDirection({}, Eigen::Vector3d::Zero()), Eigen::Vector3d(0, -1, 0));
}

}  // namespace
}  // namespace mono3d::tools
