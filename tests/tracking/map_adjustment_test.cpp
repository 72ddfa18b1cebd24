// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/optimisation/map_adjustment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

Pose TruePose(int i) {
  return {RotationExp({0.01 * i, -0.02 * i, 0}), Eigen::Vector3d(-0.3 * i, 0.1 * i * i, 0)};
}

// Keyframes that all see all points, at their true poses and places but for `T_second`.
Map YoungMap(int num_keyframes, const Pose& T_second, std::mt19937& random) {
  Map map(0, SmallCamera(), FeatureOptions{});
  std::vector<Eigen::Vector3d> points;
  for (int k = 0; k < 80; ++k) {
    points.emplace_back(Uniform(random, -2, 2), Uniform(random, -1, 1), Uniform(random, 5, 8));
  }
  for (int i = 0; i < num_keyframes; ++i) {
    std::vector<Eigen::Vector2d> pixels;
    for (const Eigen::Vector3d& p : points)
      pixels.push_back(SmallCamera().Project(TruePose(i) * p));
    View view = MakeView(SmallCamera(), pixels);
    view.T_cam_world = i == 1 ? T_second : TruePose(i);
    map.AddKeyframe(std::move(view));
  }
  for (std::size_t k = 0; k < points.size(); ++k) {
    const PointId point = map.AddPoint(points[k]);
    for (KeyframeId id = 0; id < map.keyframes().size(); ++id) map.AddObservation(point, {id, k});
    map.UpdatePoint(point);
  }
  return map;
}

double SumOfDistances(const Map& map) {
  double sum = 0;
  for (const MapKeyframe& keyframe : map.keyframes()) {
    sum += (keyframe.view.Centre() - map.keyframe(0).view.Centre()).norm();
  }
  return sum;
}

// How the first two keyframes of a map lie to each other came from two views alone.
TEST(AdjustLocally, SetsTheFirstTwoKeyframesOfAYoungMapRight) {
  std::mt19937 random(SeedFromTestName());
  const Pose off(RotationExp({0, 0.02, 0.01}), Eigen::Vector3d(0.05, -0.03, 0.04));
  Map map = YoungMap(5, off * TruePose(1), random);
  const double size_before = SumOfDistances(map);
  MappingLock alone;
  AdjustLocally(map, 4, LocalMappingOptions{}, alone);
  AdjustLocally(map, 4, LocalMappingOptions{}, alone);
  EXPECT_NEAR(SumOfDistances(map), size_before, 1e-9);
  const Pose found = map.T_cam_world(1) * map.T_cam_world(0).Inverse();
  const Pose truth = TruePose(1) * TruePose(0).Inverse();
  // The pictures are exact: what is left is where the adjustment ends, at a thousandth of the cost.
  constexpr double kMaxAngle_deg = 0.01;
  EXPECT_LT((found * truth.Inverse()).RotationAngle() * 180 / std::numbers::pi, kMaxAngle_deg);
  EXPECT_GT(found.translation().normalized().dot(truth.translation().normalized()),
            std::cos(kMaxAngle_deg * 10 * std::numbers::pi / 180));
}

}  // namespace
}  // namespace mono3d::tracking
