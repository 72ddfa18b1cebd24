// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/camera_solver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include "calibration/calibration_maps.h"
#include "calibration/camera_problem.h"
#include "reference/random.h"

namespace mono3d::calibration {
namespace {

// From a camera whose focal length is a quarter too short, through a rolling shutter, with some
// observations that are wrong.
CameraProblem ProblemWithOutliers() {
  CameraModel truth = TrueCamera();
  truth.shutter = {0.02, false};
  SparseModel map = MakeRollingMap(truth, 5);
  std::mt19937 random(6);
  for (SparseImage& image : map.images) {
    for (std::size_t i = 0; i < image.observations.size(); i += 20) {
      for (double& coordinate : image.observations[i].pixel) coordinate += Normal(random, 5);
    }
  }
  const std::vector<SparseModel> maps = {map};
  CameraModel start = UnknownCamera().camera;
  start.fx = start.fy = 0.75 * truth.fx;
  return {{.maps = maps, .max_points = 100}, start, UnknownCamera()};
}

// The cost with one unknown moved.
template <typename Move>
double CostWhere(CameraProblem& problem, const Move& move) {
  const CameraProblem::Unknowns at = problem.unknowns();
  CameraProblem::Unknowns moved = at;
  move(moved);
  problem.set_unknowns(moved);
  const double cost = problem.Cost().sum;
  problem.set_unknowns(at);
  return cost;
}

// By how much the cost would fall if this unknown were where it is least, by its values around.
template <typename Pick>
double GainOf(CameraProblem& problem, double step, const Pick& pick) {
  const double here = problem.Cost().sum;
  const double above = CostWhere(problem, [&](auto& at) { pick(at) += step; });
  const double below = CostWhere(problem, [&](auto& at) { pick(at) -= step; });
  const double slope = (above - below) / 2;
  const double curvature = above + below - 2 * here;
  EXPECT_GT(curvature, 0);
  return slope * slope / (2 * curvature);
}

TEST(CameraSolver, EndsWhereTheCostIsLeast) {
  CameraProblem problem = ProblemWithOutliers();
  for (int i = 0; i < 4; ++i) Solve(problem, 1e-10);
  // Of a cost that is about half of the number of residuals.
  constexpr double kLeast = 1e-3;
  for (int i = 0; i < kNumParameters; ++i) {
    if (problem.is_fixed()[i]) continue;
    const double step = i == kCx || i == kCy ? 1e-2 : 1e-5;
    EXPECT_LT(GainOf(problem, step, [&](auto& at) -> double& { return at.cameras[0][i]; }), kLeast)
        << i;
  }
  for (std::size_t k = 0; k < 6; ++k) {
    EXPECT_LT(GainOf(problem, 1e-4, [&](auto& at) -> double& { return at.poses[2][k]; }), kLeast);
    EXPECT_LT(GainOf(problem, 1e-3, [&](auto& at) -> double& { return at.velocity_changes[2][k]; }),
              kLeast);
  }
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_LT(GainOf(problem, 1e-3, [&](auto& at) -> double& { return at.points[7][k]; }), kLeast);
  }
  EXPECT_NEAR(std::exp(problem.parameters()[kLogFocal]), TrueCamera().fx, 0.01 * TrueCamera().fx);
  EXPECT_NEAR(problem.parameters()[kReadoutByRows], 0.02, 1e-3);
}

// Straight down on flat ground, longer focal lengths agree with the images nearly as well, with the
// ground farther away and the camera turned less.
TEST(CameraSolver, EndsAtTheFocalLengthOfASwayingStrip) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const std::vector<SparseModel> maps = {MakeMap(TrueCamera(), Way::kStrip, seed, 2)};
    CameraModel start = UnknownCamera().camera;
    start.fx = start.fy = 0.7 * TrueCamera().fx;
    CameraProblem problem({.maps = maps}, start, UnknownCamera());
    for (const double min_gain : {1e-2, 1e-4, 1e-6}) Solve(problem, min_gain);
    const double found = problem.parameters()[kLogFocal];
    for (int i = 0; i < 10; ++i) Solve(problem, 1e-10);
    EXPECT_NEAR(found, problem.parameters()[kLogFocal], 2e-3);
    EXPECT_NEAR(found, std::log(TrueCamera().fx), 0.05);
  }
}

TEST(CameraSolver, WithoutPointsTakesTheCameraOfThePrior) {
  const std::vector<SparseModel> maps(1);
  CameraProblem problem({.maps = maps}, TrueCamera(), UnknownCamera());
  Solve(problem, 1e-6);
  EXPECT_EQ(problem.num_points(), 0U);
  EXPECT_LT((problem.parameters() - problem.prior()).cwiseAbs().maxCoeff(), 1e-3);
}

}  // namespace
}  // namespace mono3d::calibration
