// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/optimisation/path_uncertainty.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "tracking/optimisation/bundle_adjustment.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

constexpr int kNumViews = 12;  // the first half goes to the right, the second one ahead
constexpr double kSigma_px = 0.3;

const std::vector<std::size_t> kBefore = {0, 1, 2, 3, 4, 5};
const std::vector<std::size_t> kAfter = {6, 7, 8, 9, 10, 11};

// `num_shared` points are seen by all views, as many others by the views of either half alone.
BundleAdjustmentProblem TwoPaths(int num_shared, int num_others, std::mt19937& random) {
  BundleAdjustmentProblem problem;
  problem.camera = SmallCamera();
  for (int i = 0; i < kNumViews; ++i) {
    const Eigen::Vector3d centre(0.2 * std::min(i, 6), 0, 0.3 * std::max(i - 6, 0));
    problem.T_cam_world.emplace_back(Eigen::Quaterniond::Identity(), -centre);
    problem.is_fixed.push_back(i == 0 ? 1 : 0);
  }
  std::uniform_real_distribution<double> u(0.2, 0.8);
  std::uniform_real_distribution<double> depth(5, 12);
  for (int i = 0; i < num_shared + 2 * num_others; ++i) {
    const Eigen::Vector2d pixel(u(random) * problem.camera.width,
                                u(random) * problem.camera.height);
    const Eigen::Vector3d p_world =
        depth(random) * problem.camera.Unproject(pixel) + Eigen::Vector3d(0.6, 0, 0);
    const bool is_shared = i < num_shared;
    const bool is_before = i < num_shared + num_others;
    for (std::size_t view = 0; view < kNumViews; ++view) {
      if (!is_shared && is_before != (view < kNumViews / 2)) continue;
      problem.observations.push_back({view, problem.p_world.size(),
                                      problem.camera.Project(problem.T_cam_world[view] * p_world),
                                      kSigma_px});
    }
    problem.p_world.push_back(p_world);
  }
  return problem;
}

void AddNoise(BundleAdjustmentProblem& problem, std::mt19937& random) {
  std::normal_distribution<double> noise(0, kSigma_px);
  for (BundleAdjustmentObservation& seen : problem.observations) {
    seen.pixel += Eigen::Vector2d(noise(random), noise(random));
  }
}

double LogRatio(const BundleAdjustmentProblem& problem) {
  return std::log(PathSize(problem.T_cam_world, kAfter) / PathSize(problem.T_cam_world, kBefore));
}

// Of the view in the middle of the one path against that of the other.
Eigen::Quaterniond TurnBetween(const BundleAdjustmentProblem& problem) {
  return problem.T_cam_world[kAfter[3]].rotation() *
         problem.T_cam_world[kBefore[3]].rotation().conjugate();
}

TEST(RelativePathSigma, IsThatOfAdjustmentsOfNoisyPixels) {
  std::mt19937 random(SeedFromTestName());
  const BundleAdjustmentProblem exact = TwoPaths(8, 40, random);
  const double truth = LogRatio(exact);
  const Eigen::Quaterniond turn_true = TurnBetween(exact);
  constexpr int kNumDraws = 60;
  double sum = 0;
  double sum_turn = 0;
  PathSigma sum_sigma;
  for (int draw = 0; draw < kNumDraws; ++draw) {
    BundleAdjustmentProblem noisy = exact;
    AddNoise(noisy, random);
    SolveBundleAdjustment(noisy, {.num_robust_steps = 0, .num_steps = 30, .min_gain = 1e-9});
    sum += std::pow(LogRatio(noisy) - truth, 2);
    sum_turn += RotationLog(TurnBetween(noisy) * turn_true.conjugate()).squaredNorm() / 3;
    const PathSigma sigma = RelativePathSigma(noisy, kBefore, kAfter);
    sum_sigma.log_scale += sigma.log_scale;
    sum_sigma.rotation_rad += sigma.rotation_rad;
  }
  // The standard deviation of 60 draws is known to 9 %.
  const double measured = std::sqrt(sum / kNumDraws);
  EXPECT_NEAR(sum_sigma.log_scale / kNumDraws, measured, 0.3 * measured);
  EXPECT_GT(measured, 1e-3);
  const double turn_rad = std::sqrt(sum_turn / kNumDraws);
  EXPECT_NEAR(sum_sigma.rotation_rad / kNumDraws, turn_rad, 0.3 * turn_rad);
  EXPECT_GT(turn_rad, 1e-5);
}

TEST(RelativePathSigma, IsLargerWhereFewerPointsTieThePaths) {
  std::mt19937 random(SeedFromTestName());
  const double by_many = RelativePathSigma(TwoPaths(60, 40, random), kBefore, kAfter).log_scale;
  const double by_few = RelativePathSigma(TwoPaths(6, 40, random), kBefore, kAfter).log_scale;
  EXPECT_GT(by_many, 0);
  EXPECT_GT(by_few, 2 * by_many);
}

TEST(RelativePathSigma, IsBeyondAllBoundsWhereNothingTiesThem) {
  std::mt19937 random(SeedFromTestName());
  EXPECT_GT(RelativePathSigma(TwoPaths(0, 40, random), kBefore, kAfter).log_scale, 10);
}

}  // namespace
}  // namespace mono3d::tracking
