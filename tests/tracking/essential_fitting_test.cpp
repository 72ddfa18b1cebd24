// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/start/essential_fitting.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>
#include <span>
#include <vector>

#include "mono3d/geometry/fundamental.h"
#include "tracking/start/two_view_start.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

constexpr double kCornerNoise_px = 0.7;
constexpr double kNearShare = 0.6;  // of the points: on the car close by
constexpr int kNumStreets = 40;

// A point of a street as a car sees it: another car close by, the road, houses far away.
Eigen::Vector3d StreetPoint(double near_share, std::mt19937& random) {
  const double kind = Uniform(random, 0, 1);
  if (kind < near_share) return {-1.5, Uniform(random, -1, 1.7), Uniform(random, 2.5, 8)};
  if (kind < near_share + 0.15) return {Uniform(random, -8, 8), 1.7, Uniform(random, 6, 40)};
  return {Uniform(random, -20, 20), Uniform(random, -8, 1), Uniform(random, 40, 60)};
}

std::vector<PointPair> PairsOfStreet(const Pose& T_b_a, int num_pairs, std::mt19937& random,
                                     double near_share = kNearShare) {
  const CameraModel camera = SmallCamera();
  std::vector<PointPair> pairs;
  while (std::ssize(pairs) < num_pairs) {
    const Eigen::Vector3d p = StreetPoint(near_share, random);
    const auto pixel = [&](const Eigen::Vector3d& p_cam) -> Eigen::Vector2d {
      return camera.Project(p_cam) +
             Eigen::Vector2d(Normal(random, kCornerNoise_px), Normal(random, kCornerNoise_px));
    };
    const PointPair pair{pixel(p), pixel(T_b_a * p)};
    if (camera.Contains(pair.a) && camera.Contains(pair.b)) pairs.push_back(pair);
  }
  return pairs;
}

// A camera that moved ahead by `way` and turned to the side by so much.
Pose Ahead(double way, double turn_deg) {
  const double turn = turn_deg * std::numbers::pi / 180;
  const Eigen::Quaterniond rotation = RotationExp({0, -turn, 0});
  return {rotation, rotation * Eigen::Vector3d(0, 0, -way)};
}

double DirectionErrorDeg(const Pose& found, const Pose& truth) {
  const auto ahead = [](const Pose& T_b_a) {
    return T_b_a.Inverse().translation().normalized().eval();
  };
  return std::acos(std::clamp(ahead(found).dot(ahead(truth)), -1., 1.)) * 180 / std::numbers::pi;
}

Eigen::Matrix3d EssentialOf(const Pose& T_b_a) {
  const Eigen::Matrix3d identity = Eigen::Matrix3d::Identity();
  return FundamentalFromMotion(T_b_a, identity, identity).normalized();
}

TEST(FitEssentials, FindsTheMotionFromAGuessThatIsFarOff) {
  std::mt19937 random(SeedFromTestName());
  const Pose truth = Ahead(2, 1);
  const std::vector<PointPair> pairs = PairsOfStreet(truth, 400, random);
  const Pose to_the_side(Eigen::Quaterniond::Identity(), Eigen::Vector3d(1, 0, 0));
  const auto fits = FitEssentials(std::span(&to_the_side, 1), pairs, SmallCamera(), 1);
  ASSERT_EQ(fits.size(), 1U);
  EXPECT_EQ(fits[0].losses.size(), pairs.size());
  EXPECT_NEAR(fits[0].essential.norm(), 1, 1e-9);
  // By the cosine of 1.5 degrees.
  EXPECT_GT(std::abs(fits[0].essential.cwiseProduct(EssentialOf(truth)).sum()), 0.99966);
}

TEST(FitEssentials, BeginsWithTheBestAndNeedsEightPairs) {
  std::mt19937 random(SeedFromTestName());
  const std::vector<PointPair> pairs = PairsOfStreet(Ahead(0.05, 0.5), 200, random);
  const auto fits = FitEssentials({}, pairs, SmallCamera(), 1);
  ASSERT_GE(fits.size(), 1U);
  const auto sum = [](const EpipolarFit& fit) {
    return std::accumulate(fit.losses.begin(), fit.losses.end(), 0.);
  };
  EXPECT_TRUE(std::ranges::is_sorted(fits, {}, sum));
  EXPECT_TRUE(FitEssentials({}, std::span(pairs).first(7), SmallCamera(), 1).empty());
}

struct StreetStarts {
  int num_clear = 0;  // with one motion
  int num_wrong = 0;  // of these
};

// Of cars that moved ahead by so much and turned by a degree at most.
StreetStarts StartOnStreets(double min_way, double max_way, std::mt19937& random,
                            double near_share = kNearShare) {
  const CameraModel camera = SmallCamera();
  StreetStarts starts;
  for (int i = 0; i < kNumStreets; ++i) {
    const Pose truth = Ahead(Uniform(random, min_way, max_way), Uniform(random, -1, 1));
    std::vector<Eigen::Vector2d> in_a;
    std::vector<Eigen::Vector2d> in_b;
    std::vector<FeatureMatch> matches;
    for (const PointPair& pair : PairsOfStreet(truth, 600, random, near_share)) {
      matches.push_back({in_a.size(), in_a.size()});
      in_a.push_back(pair.a);
      in_b.push_back(pair.b);
    }
    const StartAttempt attempt =
        StartFromTwoViews(MakeView(camera, in_a), MakeView(camera, in_b), matches, camera, {}, 1);
    if (attempt.candidates.size() != 1) continue;
    ++starts.num_clear;
    if (DirectionErrorDeg(attempt.candidates[0].T_b_a, truth) > 15) ++starts.num_wrong;
  }
  return starts;
}

// A way to the side and a turn against it explain the first decimetres nearly as well as the way
// ahead, and better by chance. One wrong motion alone would start a map.
TEST(StartFromTwoViews, TakesNoWrongMotionAloneOfACarThatSetsOff) {
  std::mt19937 random(SeedFromTestName());
  EXPECT_EQ(StartOnStreets(0.1, 0.3, random).num_wrong, 0);
}

// Far houses outweigh what is near, so that a homography fits. None of its motions is right.
TEST(StartFromTwoViews, TakesNoMotionOverAPlaneWhereReliefShowsAnother) {
  std::mt19937 random(SeedFromTestName());
  EXPECT_EQ(StartOnStreets(0.1, 0.5, random, 0.25).num_wrong, 0);
  const StreetStarts under_way = StartOnStreets(1, 2, random, 0.25);
  EXPECT_EQ(under_way.num_wrong, 0);
  EXPECT_GE(under_way.num_clear, kNumStreets * 3 / 4);
}

TEST(StartFromTwoViews, TakesTheMotionOfACarThatIsUnderWay) {
  std::mt19937 random(SeedFromTestName());
  const StreetStarts starts = StartOnStreets(1, 2, random);
  EXPECT_EQ(starts.num_wrong, 0);
  EXPECT_GE(starts.num_clear, kNumStreets * 3 / 4);
}

}  // namespace
}  // namespace mono3d::tracking
