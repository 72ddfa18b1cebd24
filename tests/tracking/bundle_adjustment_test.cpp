// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/optimisation/bundle_adjustment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tracking/optimisation/dense_schur_solver.h"
#include "tracking/optimisation/scale_gauge.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

struct BundleWorld {
  BundleAdjustmentProblem problem;
  std::vector<Pose> truth;
  std::size_t num_outliers = 0;  // the first observations
};

// Six views along a line over 80 points; all but the first two views are disturbed.
BundleWorld MakeWorld(double scale, std::mt19937& random) {
  BundleWorld world;
  BundleAdjustmentProblem& problem = world.problem;
  problem.camera = SmallCamera();
  for (int i = 0; i < 6; ++i) {
    const Pose truth(RotationExp({0, -0.02 * i, 0}), scale * Eigen::Vector3d(-0.8 * i, 0, 0.1 * i));
    world.truth.push_back(truth);
    problem.is_fixed.push_back(i < 2 ? 1 : 0);
  }
  while (problem.p_world.size() < 80) {
    const Eigen::Vector2d pixel(Uniform(random, 0, 383), Uniform(random, 0, 223));
    const Eigen::Vector3d p = scale * Uniform(random, 8, 14) * problem.camera.Unproject(pixel);
    for (std::size_t view = 0; view < world.truth.size(); ++view) {
      const Eigen::Vector2d seen = problem.camera.Project(world.truth[view] * p);
      if (!problem.camera.Contains(seen)) continue;
      const Eigen::Vector2d noise(Normal(random, 0.3), Normal(random, 0.3));
      problem.observations.push_back({view, problem.p_world.size(), seen + noise, 1});
    }
    const Eigen::Vector3d error(Normal(random, 0.2), Normal(random, 0.2), Normal(random, 0.5));
    problem.p_world.push_back(p + scale * error);
  }
  for (const Pose& truth : world.truth) {
    const bool fixed = problem.is_fixed[problem.T_cam_world.size()] != 0;
    const double size = fixed ? 0 : 0.02;
    const Pose error(RotationExp({Normal(random, size / 2), Normal(random, size / 2), 0}),
                     scale * Eigen::Vector3d(Normal(random, size), 0, Normal(random, size)));
    problem.T_cam_world.push_back(error * truth);
  }
  world.num_outliers = 15;
  for (std::size_t i = 0; i < world.num_outliers; ++i) {
    problem.observations[7 * i].pixel += Eigen::Vector2d(25, -15);
  }
  return world;
}

TEST(SolveBundleAdjustment, LowersTheErrorToTheNoise) {
  std::mt19937 random(SeedFromTestName());
  BundleWorld world = MakeWorld(1, random);
  const BundleAdjustmentReport report = SolveBundleAdjustment(world.problem);
  EXPECT_LT(report.final_cost, 0.2 * report.initial_cost);
  for (std::size_t i = 0; i < world.truth.size(); ++i) {
    const Pose error = world.problem.T_cam_world[i] * world.truth[i].Inverse();
    // The last view is four steps from the two fixed ones and rests on half of the points: several
    // times the 0.3 px of 345 in angle, and that at a depth of 11.
    EXPECT_LT(error.RotationAngle(), 0.01) << i;
    EXPECT_LT(error.translation().norm(), 0.1) << i;
  }
}

TEST(HoldDistance, GivesTheScaleThatThePixelsLeaveOpen) {
  std::mt19937 random(SeedFromTestName());
  BundleWorld world = MakeWorld(1, random);
  world.problem.is_fixed[1] = 0;
  const double distance = world.problem.T_cam_world[1].Inverse().translation().norm();
  BundleAdjustmentProblem without = world.problem;
  world.problem.constraints = {HoldDistance(world.problem, 1, 0)};
  const BundleAdjustmentReport report = SolveBundleAdjustment(world.problem, {20, 20, 1e-8});
  const double held = world.problem.T_cam_world[1].Inverse().translation().norm();
  constexpr double kTolerance = 1e-3;  // the direction turns by a fiftieth
  EXPECT_NEAR(held, distance, kTolerance * distance);
  // It costs nothing: the pixels are met as well as without.
  const BundleAdjustmentReport report_without = SolveBundleAdjustment(without, {20, 20, 1e-8});
  EXPECT_NEAR(report.final_cost, report_without.final_cost, 0.01 * report_without.final_cost);
  const double free = without.T_cam_world[1].Inverse().translation().norm();
  EXPECT_GT(std::abs(free - distance), 5 * kTolerance * distance);
}

TEST(RestoreDepths, UndoesAScalingOfTheWorld) {
  std::mt19937 random(SeedFromTestName());
  const BundleWorld world = MakeWorld(1, random);
  BundleAdjustmentProblem scaled = world.problem;
  const Eigen::Vector3d centre = scaled.T_cam_world[0].Inverse().translation();
  constexpr double kFactor = 1.7;
  for (Eigen::Vector3d& p : scaled.p_world) p = centre + kFactor * (p - centre);
  for (Pose& T : scaled.T_cam_world) {
    const Eigen::Vector3d moved = centre + kFactor * (T.Inverse().translation() - centre);
    T = Pose(T.rotation(), T.rotation() * -moved);
  }
  RestoreDepths(world.problem.p_world, scaled);
  for (std::size_t i = 0; i < scaled.p_world.size(); ++i) {
    EXPECT_LT((scaled.p_world[i] - world.problem.p_world[i]).norm(), 1e-5);
  }
  for (std::size_t i = 0; i < scaled.T_cam_world.size(); ++i) {
    const Pose difference = scaled.T_cam_world[i] * world.problem.T_cam_world[i].Inverse();
    EXPECT_LT(difference.translation().norm() + difference.RotationAngle(), 1e-5);
  }
}

TEST(SolveBundleAdjustment, NamesTheOutliers) {
  std::mt19937 random(SeedFromTestName());
  BundleWorld world = MakeWorld(1, random);
  const BundleAdjustmentReport report = SolveBundleAdjustment(world.problem);
  std::size_t num_named = 0;
  for (const char is_outlier : report.is_outlier) num_named += is_outlier != 0 ? 1U : 0U;
  for (std::size_t i = 0; i < world.num_outliers; ++i) EXPECT_NE(report.is_outlier[7 * i], 0) << i;
  EXPECT_LE(num_named, world.num_outliers + 5);  // at 3 sigma of the noise hardly any other
}

TEST(SolveBundleAdjustment, LeavesFixedViewsAlone) {
  std::mt19937 random(SeedFromTestName());
  BundleWorld world = MakeWorld(1, random);
  SolveBundleAdjustment(world.problem);
  for (const std::size_t i : {0U, 1U}) {
    EXPECT_EQ((world.problem.T_cam_world[i].Matrix() - world.truth[i].Matrix()).norm(), 0);
  }
}

TEST(SolveBundleAdjustment, GivesTheSameBitsTwice) {
  const auto run = [] {
    std::mt19937 random(SeedFromTestName());
    BundleWorld world = MakeWorld(1, random);
    SolveBundleAdjustment(world.problem);
    return world.problem;
  };
  const BundleAdjustmentProblem first = run();
  const BundleAdjustmentProblem second = run();
  EXPECT_EQ(first.p_world, second.p_world);
  for (std::size_t i = 0; i < first.T_cam_world.size(); ++i) {
    EXPECT_EQ(first.T_cam_world[i].Matrix(), second.T_cam_world[i].Matrix());
  }
}

TEST(SolveBundleAdjustment, IsTheSameAtAThousandTimesTheScale) {
  const auto run = [](double scale) {
    std::mt19937 random(SeedFromTestName());
    BundleWorld world = MakeWorld(scale, random);
    const BundleAdjustmentReport report = SolveBundleAdjustment(world.problem);
    return std::pair(Eigen::Vector3d(world.problem.T_cam_world[5].translation() / scale),
                     report.is_outlier);
  };
  const auto small = run(1);
  const auto large = run(1000);
  EXPECT_LT((small.first - large.first).norm(), 1e-3);  // a tenth of the noise
  EXPECT_EQ(small.second, large.second);
}

TEST(SolveBundleAdjustment, ReportsPointsBehindACameraAsOutliers) {
  std::mt19937 random(SeedFromTestName());
  BundleWorld world = MakeWorld(1, random);
  world.problem.p_world[3] = Eigen::Vector3d(0, 0, -5);
  const BundleAdjustmentReport report = SolveBundleAdjustment(world.problem);
  for (std::size_t i = 0; i < world.problem.observations.size(); ++i) {
    if (world.problem.observations[i].point == 3) {
      EXPECT_NE(report.is_outlier[i], 0);
    }
  }
  EXPECT_LT(report.final_cost, report.initial_cost);
}

double SquaredError(const BundleAdjustmentProblem& problem) {
  double sum = 0;
  for (const BundleAdjustmentObservation& o : problem.observations) {
    const Eigen::Vector3d p_cam = problem.T_cam_world[o.view] * problem.p_world[o.point];
    sum += (problem.camera.Project(p_cam) - o.pixel).squaredNorm();
  }
  return sum;
}

TEST(MinimiseDensely, EndsWhereNoStepLowersTheCost) {
  std::mt19937 random(SeedFromTestName());
  BundleAdjustmentProblem problem = MakeWorld(1, random).problem;
  const std::vector<char> none(problem.observations.size(), 0);
  MinimiseDensely(problem, none, false, 50, {.min_gain = 1e-12});
  const double cost = SquaredError(problem);
  const auto moved_cost = [&](std::size_t view, const Eigen::Vector3d& lock,
                              const Eigen::Vector3d& shift) {
    BundleAdjustmentProblem moved = problem;
    Pose& T = moved.T_cam_world[view];
    T = Pose(RotationExp(lock) * T.rotation(), T.translation() + shift);
    return SquaredError(moved);
  };
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d unit = Eigen::Vector3d::Unit(axis);
    for (const double sign : {-1.0, 1.0}) {
      for (std::size_t view = 2; view < 6; ++view) {
        EXPECT_GT(moved_cost(view, sign * 1e-3 * unit, {0, 0, 0}), cost);
        EXPECT_GT(moved_cost(view, {0, 0, 0}, sign * 1e-2 * unit), cost);
      }
      BundleAdjustmentProblem moved = problem;
      moved.p_world[11] += sign * 0.1 * unit;
      EXPECT_GT(SquaredError(moved), cost);
    }
  }
}

TEST(MinimiseDensely, LeavesFixedViewsAndWhatIsUnseenAlone) {
  std::mt19937 random(SeedFromTestName());
  BundleAdjustmentProblem problem = MakeWorld(1, random).problem;
  problem.p_world.emplace_back(1, 2, 3);
  problem.T_cam_world.emplace_back(Eigen::Quaterniond::Identity(), Eigen::Vector3d(3, 2, 1));
  problem.is_fixed.push_back(0);
  const BundleAdjustmentProblem before = problem;
  MinimiseDensely(problem, std::vector<char>(problem.observations.size(), 0), true, 5, {});
  EXPECT_EQ(problem.T_cam_world[0].Matrix(), before.T_cam_world[0].Matrix());
  EXPECT_EQ(problem.T_cam_world[1].Matrix(), before.T_cam_world[1].Matrix());
  EXPECT_NE(problem.T_cam_world[2].Matrix(), before.T_cam_world[2].Matrix());
  EXPECT_EQ(problem.p_world.back(), before.p_world.back());
  EXPECT_EQ(problem.T_cam_world.back().Matrix(), before.T_cam_world.back().Matrix());
}

// Enough free views for the sparse solver: it must come to the same result as the dense one.
TEST(SolveBundleAdjustment, GivesTheSameWithManyViewsAsWithFew) {
  std::mt19937 random(SeedFromTestName());
  BundleAdjustmentProblem few = MakeWorld(1, random).problem;
  BundleAdjustmentProblem many = few;
  for (int i = 0; i < 450; ++i) {  // views that see nothing only make it large
    many.T_cam_world.emplace_back();
    many.is_fixed.push_back(0);
  }
  constexpr int kSteps = 50;
  SolveBundleAdjustment(few, {kSteps, kSteps, 1e-8});
  SolveBundleAdjustment(many, {kSteps, kSteps, 1e-8});
  for (std::size_t i = 0; i < few.T_cam_world.size(); ++i) {
    const Pose difference = few.T_cam_world[i] * many.T_cam_world[i].Inverse();
    // Both stop shortly before the very minimum.
    EXPECT_LT(difference.translation().norm(), 1e-2) << i;
    EXPECT_LT(difference.RotationAngle(), 1e-3) << i;
  }
}

}  // namespace
}  // namespace mono3d::tracking
