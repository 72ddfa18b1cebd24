// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/positions/image_drift.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include "reference/random.h"
#include "tracking/optimisation/bundle_adjustment.h"
#include "tracking/optimisation/path_uncertainty.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

constexpr double kStepOfStrip = 1;
constexpr double kDepthOfStrip = 10;
constexpr double kPixelSigma = 0.3;

// Straight on over rough ground, each point in some ten keyframes; poses and points are the true
// ones, pixels are off by `sigma_px`.
Map MakeStrip(KeyframeId num_keyframes, std::mt19937& random, double sigma_px) {
  std::normal_distribution<double> noise;
  Map map(0, SmallCamera(), FeatureOptions{});
  const auto centre = [](KeyframeId i) {
    return Eigen::Vector3d(kStepOfStrip * static_cast<double>(i), 0, 0);
  };
  for (KeyframeId i = 0; i < num_keyframes; ++i) {
    View view;
    view.frame.index = static_cast<std::int64_t>(i);
    view.frame.timestamp_s = static_cast<double>(i);
    view.frame.camera = SmallCamera();
    view.T_cam_world = Pose(Eigen::Quaterniond::Identity(), -centre(i));
    map.AddKeyframe(view);
  }
  const double length = kStepOfStrip * static_cast<double>(num_keyframes);
  for (int n = 0; n < static_cast<int>(20 * length); ++n) {
    const Eigen::Vector3d p(Uniform(random, -5, length + 5), Uniform(random, -3, 3),
                            kDepthOfStrip + Uniform(random, -1, 1));
    std::vector<KeyframeId> seeing;
    for (KeyframeId i = 0; i < num_keyframes; ++i) {
      if (SmallCamera().Contains(SmallCamera().Project(p - centre(i)))) seeing.push_back(i);
    }
    if (seeing.size() < 3) continue;
    const PointId point = map.AddPoint(p);
    for (const KeyframeId i : seeing) {
      Feature feature;
      feature.pixel = SmallCamera().Project(p - centre(i)) +
                      sigma_px * Eigen::Vector2d(noise(random), noise(random));
      feature.sigma_px = kPixelSigma;
      map.AddObservation(point, i, feature);
    }
    map.UpdateGeometry(point);
  }
  return map;
}

std::vector<KeyframeId> AllKeyframes(const Map& map) {
  std::vector<KeyframeId> keyframes(map.keyframes().size());
  std::iota(keyframes.begin(), keyframes.end(), 0);
  return keyframes;
}

// Adjusted as a whole from pixels with noise.
std::vector<Pose> AdjustWithNoise(const Map& map, std::mt19937& random) {
  std::normal_distribution<double> noise(0, kPixelSigma);
  BundleAdjustmentProblem problem;
  problem.camera = map.camera();
  std::vector<std::size_t> number(map.points().size());
  for (const PointId id : map.PointIds()) {
    number[id.index] = problem.p_world.size();
    problem.p_world.push_back(map.point(id).p_world);
  }
  for (const KeyframeId id : AllKeyframes(map)) {
    const View& view = map.keyframe(id).view;
    for (std::size_t i = 0; i < view.points.size(); ++i) {
      if (!view.points[i]) continue;
      problem.observations.push_back(
          {id, number[view.points[i]->index],
           view.features[i].pixel + Eigen::Vector2d(noise(random), noise(random)), kPixelSigma});
    }
    problem.T_cam_world.push_back(view.T_cam_world);
    problem.is_fixed.push_back(id == 0 ? 1 : 0);
  }
  SolveBundleAdjustment(problem, {.num_robust_steps = 0, .num_steps = 20, .min_gain = 1e-8});
  return problem.T_cam_world;
}

// By how much a path that is adjusted as a whole drifts from one end to the other.
TEST(ImageDrift, IsWhatAnAdjustedPathDriftsBy) {
  constexpr KeyframeId kNum = 72;
  std::mt19937 random(SeedFromTestName());
  const Map noisy = MakeStrip(kNum, random, kPixelSigma);
  const std::optional<PathDrift> drift = ImageDrift(StretchesOf(noisy, AllKeyframes(noisy)));
  ASSERT_TRUE(drift.has_value());
  const Map map = MakeStrip(kNum, random, 0);
  std::vector<std::size_t> before(12);
  std::iota(before.begin(), before.end(), 0);
  std::vector<std::size_t> after(12);
  std::iota(after.begin(), after.end(), kNum - 12);
  constexpr int kNumDraws = 16;
  double turn = 0;
  double scale = 0;
  for (int draw = 0; draw < kNumDraws; ++draw) {
    const std::vector<Pose> poses = AdjustWithNoise(map, random);
    const Eigen::Quaterniond R =
        poses[after[6]].rotation() * poses[before[6]].rotation().conjugate();
    turn += RotationLog(R).squaredNorm() / 3;
    scale += std::pow(std::log(PathSize(poses, after) / PathSize(poses, before)), 2);
  }
  // As a random walk of 60 steps; what 16 draws measure is known to 10 to 18 %, the walk is one of
  // keyframes that are adjusted together only nearly, and the points of `noisy` were not adjusted
  // to its pixels. Errors of real pixels that neighbours share are taken to add nearly as much.
  constexpr double kSteps = 60;
  turn = std::sqrt(turn / kNumDraws / kSteps);
  scale = std::sqrt(scale / kNumDraws / kSteps);
  EXPECT_GT(drift->rotation_rad / turn, 1);
  EXPECT_LT(drift->rotation_rad / turn, 3.5);
  EXPECT_GT(drift->log_scale / scale, 1);
  EXPECT_LT(drift->log_scale / scale, 3.5);
}

TEST(ImageDrift, GrowsAsThePixelsAreOffAndNotWithThePath) {
  const auto drift_of = [](KeyframeId num_keyframes, double sigma_px) {
    std::mt19937 random(SeedFromTestName());
    const Map map = MakeStrip(num_keyframes, random, sigma_px);
    return ImageDrift(StretchesOf(map, AllKeyframes(map))).value();
  };
  const PathDrift drift = drift_of(150, 0.1);
  const PathDrift blurred = drift_of(150, 0.2);
  EXPECT_NEAR(blurred.rotation_rad / drift.rotation_rad, 2, 0.05);
  EXPECT_NEAR(blurred.log_scale / drift.log_scale, 2, 0.05);
  const PathDrift of_longer = drift_of(300, 0.1);
  EXPECT_NEAR(of_longer.rotation_rad / drift.rotation_rad, 1, 0.2);
  EXPECT_NEAR(of_longer.log_scale / drift.log_scale, 1, 0.2);
}

// On a second lap keyframes are far apart, and it is the points of the first one that tie them.
TEST(ImageDrift, IsSmallWhereALapIsFlownAgain) {
  std::mt19937 random(SeedFromTestName());
  const Map strip = MakeStrip(60, random, kPixelSigma);
  Map laps = strip;
  constexpr KeyframeId kFar = 12;  // hardly a point in common
  for (KeyframeId lap = 0; lap < 4; ++lap) {
    for (KeyframeId i = 0; i < 60; i += kFar) {
      View view = strip.keyframe(lap % 2 == 0 ? 59 - i : i).view;
      view.frame.index = static_cast<std::int64_t>(laps.keyframes().size());
      view.frame.timestamp_s = static_cast<double>(laps.keyframes().size());
      laps.AddKeyframe(view);
    }
  }
  const PathDrift once = ImageDrift(StretchesOf(strip, AllKeyframes(strip))).value();
  const PathDrift again = ImageDrift(StretchesOf(laps, AllKeyframes(laps))).value();
  EXPECT_LT(again.rotation_rad, 1.5 * once.rotation_rad);
  EXPECT_LT(again.log_scale, 1.5 * once.log_scale);
}

TEST(ImageDrift, IsNotToldByAFewKeyframes) {
  std::mt19937 random(SeedFromTestName());
  const Map map = MakeStrip(5, random, kPixelSigma);
  EXPECT_FALSE(ImageDrift(StretchesOf(map, AllKeyframes(map))).has_value());
}

}  // namespace
}  // namespace mono3d::tracking
