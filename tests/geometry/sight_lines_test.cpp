// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/sight_lines.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "mono3d/geometry/distortion.h"

namespace mono3d {
namespace {

using Eigen::Vector3d;

const Vector3d kSeenPoint(1, -2, 20);

// Cameras along x that look along z, and see kSeenPoint.
std::vector<SightLine> Lines(int count, double step, double sigma) {
  std::vector<SightLine> lines;
  for (int i = 0; i < count; ++i) {
    SightLine line{Pose(RotationExp({0.02 * i, -0.03 * i, 0.1 * i}), Vector3d(step * i, 0, 0)),
                   Vector3d::UnitZ(), sigma};
    const Vector3d p_cam = line.T_world_cam.Inverse() * kSeenPoint;
    line.ray_cam = p_cam / p_cam.z();
    lines.push_back(line);
  }
  return lines;
}

TEST(SightLines, MeetInThePointThatAllSee) {
  const SightLineResult result = MeetSightLines(Lines(5, 1, 0.001), 0.02, 5);
  ASSERT_TRUE(result.meeting.has_value());
  EXPECT_LT((result.meeting->p_world - kSeenPoint).norm(), 1e-9);
  EXPECT_EQ(result.meeting->is_outlier, std::vector<char>(5, 0));
}

TEST(SightLines, OneThatPointsElsewhereIsLeftOut) {
  std::vector<SightLine> lines = Lines(5, 1, 0.001);
  lines[1].ray_cam.x() += 0.05;
  const SightLineResult result = MeetSightLines(lines, 0.02, 5);
  ASSERT_TRUE(result.meeting.has_value());
  EXPECT_LT((result.meeting->p_world - kSeenPoint).norm(), 1e-9);
  EXPECT_EQ(result.meeting->is_outlier, (std::vector<char>{0, 1, 0, 0, 0}));
}

// Errors of the point, in its stated standard deviations, over many draws: chi-squared of three.
TEST(SightLines, StateHowWellThePointIsKnown) {
  constexpr double kSigma = 0.002;
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0, kSigma);
  constexpr int kDraws = 400;
  double sum = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    std::vector<SightLine> lines = Lines(4, 2, kSigma);
    for (SightLine& line : lines) line.ray_cam += Vector3d(normal(random), normal(random), 0);
    const SightLineResult result = MeetSightLines(lines, 0.02, 8);
    ASSERT_TRUE(result.meeting.has_value());
    const Vector3d off = result.meeting->p_world - kSeenPoint;
    sum += off.dot(result.meeting->covariance.inverse() * off);
  }
  // The mean of 400 values of variance 6 has a standard deviation of 0.12; four of them.
  EXPECT_NEAR(sum / kDraws, 3, 0.5);
}

TEST(SightLines, SayWhyTheyDoNotMeet) {
  EXPECT_EQ(MeetSightLines(Lines(1, 1, 0.001), 0.02, 5).problem, SightLineProblem::kTooFew);
  EXPECT_EQ(MeetSightLines(Lines(4, 0.01, 0.001), 0.02, 5).problem, SightLineProblem::kNoParallax);
  std::vector<SightLine> two = Lines(2, 2, 0.001);
  two[0].ray_cam.y() += 0.1;  // across the plane of both
  EXPECT_EQ(MeetSightLines(two, 0.02, 5).problem, SightLineProblem::kContradiction);
}

TEST(UnprojectDistorted, IsTheInverseOfTheLens) {
  CameraModel camera{.width = 640, .height = 480, .fx = 500, .fy = 505, .cx = 321, .cy = 236};
  for (const LensModel lens : {LensModel::kBrown, LensModel::kFisheye}) {
    camera.lens = lens;
    camera.distortion = lens == LensModel::kBrown
                            ? std::array<double, 5>{-0.28, 0.08, 0.001, -0.002, -0.005}
                            : std::array<double, 5>{0.02, -0.01, 0.002, 0, 0};
    for (double x = 0; x < 640; x += 71) {
      for (double y = 0; y < 480; y += 53) {
        const auto ray = UnprojectDistorted(camera, {x, y});
        ASSERT_TRUE(ray.has_value()) << x << " " << y;
        EXPECT_LT((ProjectDistorted(camera, *ray) - Eigen::Vector2d(x, y)).norm(), 1e-5);
      }
    }
  }
}

TEST(UnprojectDistorted, IsNothingWhereTheLensFoldsBack) {
  CameraModel camera{.width = 640, .height = 480, .fx = 300, .fy = 300, .cx = 320, .cy = 240};
  camera.distortion = {-0.4, 0, 0, 0, 0};  // the farthest pixel from the middle is at 182
  EXPECT_TRUE(UnprojectDistorted(camera, {480, 240}).has_value());
  EXPECT_FALSE(UnprojectDistorted(camera, {640, 240}).has_value());
}

}  // namespace
}  // namespace mono3d
