// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/optimisation/pose_constraint.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "reference/random.h"
#include "tracking/optimisation/bundle_adjustment.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

Pose RandomPose(std::mt19937& random, double size) {
  const auto vector = [&](double scale) {
    return Eigen::Vector3d(Normal(random, scale), Normal(random, scale), Normal(random, scale));
  };
  return {RotationExp(vector(size)), vector(3 * size)};
}

Eigen::MatrixXd RandomInformation(std::mt19937& random, int size, int rank) {
  Eigen::MatrixXd rows(rank, size);
  for (int i = 0; i < rows.size(); ++i) rows.data()[i] = Normal(random, 10);
  return rows.transpose() * rows;
}

PoseConstraint RandomConstraint(std::mt19937& random) {
  return {0, 1, RandomPose(random, 0.5), RootOf(RandomInformation(random, 6, 6))};
}

Pose MovedPose(const Pose& T, const Vector6d& step) {
  return {RotationExp(step.head<3>()) * T.rotation(), T.translation() + step.tail<3>()};
}

TEST(PoseConstraint, HasTheDerivativesOfItsError) {
  std::mt19937 random(SeedFromTestName());
  constexpr double kStep = 1e-5;
  constexpr double kTolerance = 1e-5;  // of central differences, over the largest derivative
  for (const double off : {0.0, 1e-5, 0.01, 0.7}) {  // rad, about, from the measured pose
    const PoseConstraint constraint = RandomConstraint(random);
    const Pose T_anchor = RandomPose(random, 0.8);
    const Pose T_view = RandomPose(random, off) * constraint.T_view_anchor * T_anchor;
    const ConstraintDerivatives at = Derive(constraint, T_view, T_anchor);
    EXPECT_EQ(at.error, WhitenedError(constraint, T_view, T_anchor));
    for (int i = 0; i < 6; ++i) {
      const Vector6d step = kStep * Vector6d::Unit(i);
      const Vector6d by_view = (WhitenedError(constraint, MovedPose(T_view, step), T_anchor) -
                                WhitenedError(constraint, MovedPose(T_view, -step), T_anchor)) /
                               (2 * kStep);
      const Vector6d by_anchor = (WhitenedError(constraint, T_view, MovedPose(T_anchor, step)) -
                                  WhitenedError(constraint, T_view, MovedPose(T_anchor, -step))) /
                                 (2 * kStep);
      EXPECT_LT((at.by_view.col(i) - by_view).norm(), kTolerance * at.by_view.norm()) << off;
      EXPECT_LT((at.by_anchor.col(i) - by_anchor).norm(), kTolerance * at.by_anchor.norm()) << off;
    }
  }
}

TEST(PoseConstraint, HasTheWeightOfItsCost) {
  constexpr double kStep = 1e-4;
  for (const double chi2 : {0.0, 3.0, 12.0, 500.0}) {
    const double slope = (ConstraintCost(chi2 + kStep) - ConstraintCost(chi2)) / kStep;
    EXPECT_NEAR(ConstraintWeight(chi2), slope, 1e-4);
  }
  EXPECT_NEAR(ConstraintCost(1e-3), 1e-3, 1e-6);
}

TEST(RootOf, IsARootAlsoWhereDirectionsAreOpen) {
  std::mt19937 random(SeedFromTestName());
  for (const int rank : {0, 1, 4, 7}) {
    Eigen::MatrixXd information = RandomInformation(random, 7, rank);
    const Eigen::MatrixXd root = RootOf(information);
    EXPECT_LT((root.transpose() * root - information).norm(), 1e-9 * (1 + information.norm()));
  }
}

TEST(PoseInformation, IsThatOfThePoseWhateverTheScale) {
  std::mt19937 random(SeedFromTestName());
  const Matrix7d information = RandomInformation(random, 7, 7);
  const Matrix6d covariance = information.inverse().topLeftCorner<6, 6>();
  EXPECT_LT((PoseInformation(information) * covariance - Matrix6d::Identity()).norm(), 1e-6);
  Matrix7d without_scale = information;
  without_scale.row(6).setZero();
  without_scale.col(6).setZero();
  EXPECT_EQ(PoseInformation(without_scale), Matrix6d(information.topLeftCorner<6, 6>()));
}

// Three views in a row, of which the second sees points with both others, but these none together.
struct ThreeViews {
  BundleAdjustmentProblem problem;
  std::vector<Pose> truth;
};

ThreeViews MakeThreeViews(std::mt19937& random) {
  ThreeViews world;
  BundleAdjustmentProblem& problem = world.problem;
  problem.camera = SmallCamera();
  for (int i = 0; i < 3; ++i) {
    world.truth.emplace_back(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-3 * i, 0, 0));
    problem.is_fixed.push_back(i == 0 ? 1 : 0);
  }
  for (int i = 0; i < 120; ++i) {
    const std::size_t first = i % 2 == 0 ? 0 : 1;
    const Eigen::Vector3d p(3.0 * static_cast<double>(first) + Uniform(random, 0, 3),
                            Uniform(random, -2, 2), Uniform(random, 8, 12));
    for (const std::size_t view : {first, first + 1}) {
      const Eigen::Vector2d noise(Normal(random, 0.5), Normal(random, 0.5));
      problem.observations.push_back(
          {view, problem.p_world.size(), problem.camera.Project(world.truth[view] * p) + noise, 1});
    }
    problem.p_world.push_back(p);
  }
  // What is large by a tenth from the second view on, nothing but a constraint can tell.
  problem.T_cam_world = {world.truth[0], world.truth[1],
                         Pose(Eigen::Quaterniond::Identity(), {-6.3, 0, 0})};
  return world;
}

PoseConstraint Between(const ThreeViews& world, const Pose& error) {
  constexpr double kSigma = 1e-3;  // rad; of 10 su the same angle
  Vector6d root;
  root << Eigen::Vector3d::Constant(1 / kSigma), Eigen::Vector3d::Constant(0.1 / kSigma);
  return {2, 0, error * (world.truth[2] * world.truth[0].Inverse()), root.asDiagonal()};
}

double ConstraintErrorOf(const ThreeViews& world, const BundleAdjustmentProblem& problem) {
  const Pose error = problem.T_cam_world[2] * world.truth[2].Inverse();
  return error.translation().norm() + 10 * error.RotationAngle();
}

TEST(SolveBundleAdjustment, FollowsAConstraint) {
  std::mt19937 random(SeedFromTestName());
  const ThreeViews world = MakeThreeViews(random);
  BundleAdjustmentProblem without = world.problem;
  SolveBundleAdjustment(without, {20, 20, 1e-8});
  BundleAdjustmentProblem with = world.problem;
  with.constraints = {Between(world, Pose())};
  SolveBundleAdjustment(with, {20, 20, 1e-8});
  EXPECT_LT(ConstraintErrorOf(world, with), 0.2 * ConstraintErrorOf(world, without));
}

TEST(SolveBundleAdjustment, HardlyHeedsAConstraintThatContradictsThePoints) {
  std::mt19937 random(SeedFromTestName());
  const ThreeViews world = MakeThreeViews(random);
  BundleAdjustmentProblem without = world.problem;
  SolveBundleAdjustment(without, {20, 20, 1e-8});
  BundleAdjustmentProblem with = world.problem;
  // The directions of translation are known from the points: sideways by a fifth of the depth.
  with.constraints = {Between(world, Pose(RotationExp({0.1, 0, 0}), {0, 2, 0}))};
  SolveBundleAdjustment(with, {20, 20, 1e-8});
  EXPECT_LT(ConstraintErrorOf(world, with), 1.2 * ConstraintErrorOf(world, without));
}

// The sparse solver, for which 200 views are that see nothing, comes to the same.
TEST(SolveBundleAdjustment, TakesConstraintsWithManyViewsAsWithFew) {
  std::mt19937 random(SeedFromTestName());
  BundleAdjustmentProblem few = MakeThreeViews(random).problem;
  few.constraints = {
      {2, 1, Pose(RotationExp({0.01, 0, 0}), {-3.2, 0.1, 0}), 100 * Matrix6d::Identity()}};
  BundleAdjustmentProblem many = few;
  for (int i = 0; i < 200; ++i) {
    many.T_cam_world.emplace_back();
    many.is_fixed.push_back(0);
  }
  SolveBundleAdjustment(few, {50, 50, 1e-10});
  SolveBundleAdjustment(many, {50, 50, 1e-10});
  for (std::size_t i = 0; i < few.T_cam_world.size(); ++i) {
    const Pose difference = few.T_cam_world[i] * many.T_cam_world[i].Inverse();
    EXPECT_LT(difference.translation().norm(), 1e-2) << i;
    EXPECT_LT(difference.RotationAngle(), 1e-3) << i;
  }
}

}  // namespace
}  // namespace mono3d::tracking
