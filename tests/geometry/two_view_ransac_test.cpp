// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/two_view_ransac.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/core/utility.hpp>
#include <random>
#include <vector>

#include "geometry/two_view_world.h"
#include "mono3d/geometry/fundamental.h"

namespace mono3d {
namespace {

// Half a pixel of noise over 700 px of focal length and 5 degrees of parallax, 140 inliers.
constexpr double kMaxRotationErrorDeg = 0.5;
constexpr double kMaxDirectionErrorDeg = 5;
constexpr TwoViewWorldOptions kNoisy{.num_points = 200, .noise_px = 0.5, .num_outliers = 60};

int CountInliers(const TwoViewModel& model, std::size_t first, std::size_t last) {
  return static_cast<int>(std::count(model.is_inlier.begin() + static_cast<std::ptrdiff_t>(first),
                                     model.is_inlier.begin() + static_cast<std::ptrdiff_t>(last),
                                     1));
}

// The smallest error over the hypotheses: which one it is, is for the points to say.
template <typename Motions, typename PoseOf>
void ExpectMotion(const Pose& truth, const Motions& motions, const PoseOf& pose_of) {
  double rotation = 180;
  double direction = 180;
  for (const auto& motion : motions) {
    const Pose T_b_a = pose_of(motion);
    const double error = AngleDeg(T_b_a.translation(), truth.translation());
    if (error > direction) continue;
    direction = error;
    rotation = RotationErrorDeg(T_b_a, truth);
  }
  EXPECT_LT(rotation, kMaxRotationErrorDeg);
  EXPECT_LT(direction, kMaxDirectionErrorDeg);
}

TEST(EstimateHomography, RecoversTheMotionOverAPlaneWithNoiseAndOutliers) {
  std::mt19937 random(SeedFromTestName());
  TwoViewWorldOptions options = kNoisy;
  options.planar = true;
  const TwoViewWorld world = MakeTwoViewWorld(options, random);
  const auto model = EstimateHomography(world.pairs, {});
  ASSERT_TRUE(model.has_value());
  EXPECT_GE(CountInliers(*model, 60, 200), 133);  // 95 % of 140
  EXPECT_LE(CountInliers(*model, 0, 60), 2);
  const Eigen::Matrix3d K = world.camera.Matrix();
  ExpectMotion(world.T_b_a, DecomposeHomography(K.inverse() * model->matrix * K),
               [](const PlaneMotion& motion) { return motion.T_b_a; });
}

TEST(EstimateFundamental, RecoversTheMotionOverReliefWithNoiseAndOutliers) {
  std::mt19937 random(SeedFromTestName());
  const TwoViewWorld world = MakeTwoViewWorld(kNoisy, random);
  const auto model = EstimateFundamental(world.pairs, {});
  ASSERT_TRUE(model.has_value());
  EXPECT_GE(CountInliers(*model, 60, 200), 126);  // 90 % of 140: both directions must pass
  EXPECT_LE(CountInliers(*model, 0, 60), 6);      // a line of 4 px passes more than a disc
  const Eigen::Matrix3d K = world.camera.Matrix();
  ExpectMotion(world.T_b_a, DecomposeEssential(K.transpose() * model->matrix * K),
               [](const Pose& motion) { return motion; });
}

TEST(TwoViewModels, AreFoundAmongSixtyPerCentOfOutliers) {
  std::mt19937 random(SeedFromTestName());
  for (int i = 0; i < 10; ++i) {
    TwoViewWorldOptions options{.num_points = 200, .noise_px = 0.5, .num_outliers = 120};
    const auto F = EstimateFundamental(MakeTwoViewWorld(options, random).pairs, {});
    options.planar = true;
    const auto H = EstimateHomography(MakeTwoViewWorld(options, random).pairs, {});
    ASSERT_TRUE(H && F);
    EXPECT_GE(CountInliers(*F, 120, 200), 68);  // 85 % of 80: fewer pairs determine it less well
    EXPECT_GE(CountInliers(*H, 120, 200), 76);  // 95 %
  }
}

TEST(TwoViewModels, ScoreTellsAPlaneFromRelief) {
  std::mt19937 random(SeedFromTestName());
  for (const bool planar : {true, false}) {
    TwoViewWorldOptions options = kNoisy;
    options.planar = planar;
    const TwoViewWorld world = MakeTwoViewWorld(options, random);
    const auto H = EstimateHomography(world.pairs, {});
    const auto F = EstimateFundamental(world.pairs, {});
    ASSERT_TRUE(H && F);
    const double share = H->score / (H->score + F->score);
    EXPECT_EQ(share > 0.45, planar) << share;
  }
}

TEST(TwoViewModels, AreTheSameForTheSameSeed) {
  std::mt19937 random(SeedFromTestName());
  const TwoViewWorld world = MakeTwoViewWorld(kNoisy, random);
  const auto first = EstimateFundamental(world.pairs, {.seed = 5});
  const auto second = EstimateFundamental(world.pairs, {.seed = 5});
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->matrix, second->matrix);
  EXPECT_EQ(first->is_inlier, second->is_inlier);
}

TEST(TwoViewModels, AreTheSameWithAnyNumberOfThreads) {
  std::mt19937 random(SeedFromTestName());
  const TwoViewWorld world = MakeTwoViewWorld(kNoisy, random);
  const auto several = EstimateFundamental(world.pairs, {});
  const int num_threads = cv::getNumThreads();
  cv::setNumThreads(1);
  const auto one = EstimateFundamental(world.pairs, {});
  cv::setNumThreads(num_threads);
  ASSERT_TRUE(one && several);
  EXPECT_EQ(one->matrix, several->matrix);
}

// Pairs that determine no model, or more than one: whatever comes of them is finite.
TEST(TwoViewModels, OfDegeneratePairsAreFiniteOrNone) {
  std::mt19937 random(SeedFromTestName());
  const auto draw = [&] {
    return Eigen::Vector2d(Uniform(random, 0, 767), Uniform(random, 0, 447));
  };
  std::vector<PointPair> point, line, standing, chance, twice;
  const Eigen::Vector2d fixed = draw();
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector2d a = draw();
    point.push_back({fixed, fixed});
    line.push_back({{10.0 * i, 5.0 * i}, {10.0 * i + 7, 5.0 * i + 3}});
    standing.push_back({a, a});
    chance.push_back({a, draw()});
    twice.push_back({{i % 2 * 100.0, 50}, {i % 2 * 110.0, 60}});
  }
  for (const auto& pairs : {point, line, standing, chance, twice}) {
    for (const auto& model : {EstimateHomography(pairs, {}), EstimateFundamental(pairs, {})}) {
      if (!model) continue;
      EXPECT_TRUE(model->matrix.allFinite());
      EXPECT_TRUE(std::isfinite(model->score));
      EXPECT_EQ(model->is_inlier.size(), pairs.size());
    }
  }
  const auto identity = EstimateHomography(standing, {});
  ASSERT_TRUE(identity);
  EXPECT_EQ(identity->num_inliers, 60);
}

TEST(TwoViewModels, RefuseFewerThanEightPairs) {
  std::mt19937 random(SeedFromTestName());
  const TwoViewWorld world = MakeTwoViewWorld({.num_points = 7}, random);
  EXPECT_FALSE(EstimateHomography(world.pairs, {}).has_value());
  EXPECT_FALSE(EstimateFundamental(world.pairs, {}).has_value());
}

}  // namespace
}  // namespace mono3d
