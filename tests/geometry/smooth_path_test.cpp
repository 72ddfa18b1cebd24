// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "geometry/smooth_path.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace mono3d {
namespace {

using Eigen::Vector3d;

constexpr double kRadius_m = 20;
constexpr double kTurn_rad_per_s = 0.4;  // 8 m/s

Vector3d Circle(double time_s) {
  const double angle = kTurn_rad_per_s * time_s;
  return kRadius_m * Vector3d(std::cos(angle), std::sin(angle), 0);
}

std::vector<TimedPoint> Points(const std::vector<double>& times_s) {
  std::vector<TimedPoint> points;
  for (const double time_s : times_s) points.push_back({time_s, Circle(time_s)});
  return points;
}

TEST(PointOnPath, FollowsATurnThatAChordWouldCut) {
  std::vector<double> times_s;
  for (int i = 0; i <= 40; ++i) times_s.push_back(0.25 * i);
  const std::vector<TimedPoint> path = Points(times_s);
  double farthest_m = 0;
  double farthest_of_chord_m = 0;
  for (int i = 10; i < 300; ++i) {
    const double time_s = 1 + 0.025 * i;
    const PathPoint point = PointOnPath(path, time_s);
    farthest_m = std::max(farthest_m, (point.p - Circle(time_s)).norm());
    EXPECT_NEAR(point.velocity.norm(), kTurn_rad_per_s * kRadius_m, 0.05);
    const auto before = static_cast<std::size_t>(time_s / 0.25);
    const double share = time_s / 0.25 - static_cast<double>(before);
    const Vector3d chord = (1 - share) * path[before].p + share * path[before + 1].p;
    farthest_of_chord_m = std::max(farthest_of_chord_m, (chord - Circle(time_s)).norm());
  }
  EXPECT_GT(farthest_of_chord_m, 0.02);
  EXPECT_LT(farthest_m, 0.001);
}

TEST(PointOnPath, GoesThroughItsPoints) {
  const std::vector<TimedPoint> path = Points({0, 0.3, 1, 1.1});
  for (const TimedPoint& point : path) {
    EXPECT_LT((PointOnPath(path, point.time_s).p - point.p).norm(), 1e-12);
  }
  EXPECT_LT((PointOnPath(path, -5).p - path.front().p).norm(), 1e-12);
  EXPECT_LT((PointOnPath(path, 5).p - path.back().p).norm(), 1e-12);
}

// The velocity beside a gap is that on the near side.
TEST(PointOnPath, IsNotBentByAGapBeside) {
  std::vector<double> times_s = {0, 0.25, 0.5, 0.75, 1, 6, 6.25};  // half a turn later
  const std::vector<TimedPoint> path = Points(times_s);
  EXPECT_LT((PointOnPath(path, 0.875).p - Circle(0.875)).norm(), 0.05);
}

TEST(PointOnPath, IsALineBetweenTwoPoints) {
  const std::vector<TimedPoint> path = {{1, {0, 0, 0}}, {3, {4, 0, 2}}};
  const PathPoint point = PointOnPath(path, 1.5);
  EXPECT_LT((point.p - Vector3d(1, 0, 0.5)).norm(), 1e-12);
  EXPECT_LT((point.velocity - Vector3d(2, 0, 1)).norm(), 1e-12);
}

}  // namespace
}  // namespace mono3d
