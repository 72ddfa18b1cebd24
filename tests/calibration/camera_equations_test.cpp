// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/camera_equations.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <vector>

#include "calibration/calibration_maps.h"
#include "calibration/camera_problem.h"

namespace mono3d::calibration {
namespace {

CameraProblem ProblemOfTwoCameras() {
  const std::vector<CameraModel> starts = {TrueCamera(), SecondCamera()};
  const std::vector<CameraPrior> priors = {UnknownCamera(), DefaultCameraPrior(500, 600)};
  const std::vector<SparseModel> maps = {MakeMapOfTwo(3, 1)};
  CameraProblem problem({.maps = maps, .max_points = 60}, starts, priors);
  problem.Weigh();
  return problem;
}

CameraProblem ProblemOfRollingShutter() {
  CameraModel camera = TrueCamera();
  camera.shutter = {0.02, false};
  const std::vector<SparseModel> maps = {MakeRollingMap(camera, 2)};
  CameraProblem problem({.maps = maps, .max_points = 60}, camera, UnknownCamera());
  problem.Weigh();
  return problem;
}

// All derivatives as one matrix: of the images' unknowns, the cameras', the points'.
template <int kNumOfView>
Eigen::MatrixXd AllDerivatives(const CameraProblem& problem,
                               const CameraEquations<kNumOfView>& equations) {
  const auto num_observations = static_cast<Eigen::Index>(problem.observations().size());
  const auto num_points = static_cast<Eigen::Index>(problem.num_points());
  Eigen::MatrixXd J =
      Eigen::MatrixXd::Zero(2 * num_observations, equations.size() + 3 * num_points);
  for (Eigen::Index i = 0; i < num_observations; ++i) {
    const CameraProblem::Observation& seen = problem.observations()[static_cast<std::size_t>(i)];
    const CameraProblem::Linearised row = problem.Linearise(seen);
    const Eigen::Index of_image = equations.RowOfImage(seen.image);
    J.block<2, 6>(2 * i, of_image) = row.by_pose;
    if (kNumOfView == kNumOfPoseAndVelocity) J.block<2, 6>(2 * i, of_image + 6) = row.by_velocity;
    J.block<2, kNumParameters>(2 * i, equations.RowOfCamera(problem.camera_of(seen))) =
        row.by_camera;
    J.block<2, 3>(2 * i, equations.size() + 3 * static_cast<Eigen::Index>(seen.point)) =
        row.by_point;
  }
  return J;
}

template <int kNumOfView>
void ExpectThePlainEquations(const CameraProblem& problem) {
  CameraEquations<kNumOfView> equations(problem);
  const Eigen::MatrixXd J = AllDerivatives(problem, equations);
  const Eigen::MatrixXd all = J.transpose() * J;
  const Eigen::Index size = equations.size();
  const Eigen::Index of_points = all.rows() - size;
  constexpr double kDamping = 0.01;
  Eigen::MatrixXd points = all.bottomRightCorner(of_points, of_points);
  points.diagonal() *= 1 + kDamping;
  const Eigen::MatrixXd eliminated =
      all.topRightCorner(size, of_points) * points.partialPivLu().inverse();
  const Eigen::MatrixXd plain =
      all.topLeftCorner(size, size) - eliminated * all.bottomLeftCorner(of_points, size);
  const Eigen::MatrixXd matrix = equations.Eliminate(kDamping);
  const double scale = plain.cwiseAbs().maxCoeff();
  for (Eigen::Index column = 0; column < size; ++column) {
    for (Eigen::Index row = column; row < size; ++row) {
      ASSERT_NEAR(matrix(row, column), plain(row, column), 1e-9 * scale) << row << ", " << column;
    }
  }
  EXPECT_LT((equations.Diagonal() - all.diagonal().head(size)).norm(), 1e-9 * scale);

  std::vector<Eigen::Vector2d> residuals;
  for (const CameraProblem::Observation& seen : problem.observations()) {
    residuals.push_back(problem.Linearise(seen).residual);
  }
  const Eigen::Map<const Eigen::VectorXd> as_one(residuals.front().data(), J.rows());
  const Eigen::VectorXd gradient = J.transpose() * as_one;
  const auto of = equations.GradientOf(residuals);
  EXPECT_LT((of.reduced - (gradient.head(size) - eliminated * gradient.tail(of_points))).norm(),
            1e-9 * gradient.norm());

  // The points' part of a step solves their own rows of the equations.
  Eigen::VectorXd others = Eigen::VectorXd::Random(size);
  const auto step = equations.WithPoints(others, of.points);
  Eigen::VectorXd whole(J.cols());
  whole.head(size) = others;
  for (std::size_t i = 0; i < step.points.size(); ++i) {
    whole.segment<3>(size + 3 * static_cast<Eigen::Index>(i)) = step.points[i];
  }
  const Eigen::VectorXd left = all.bottomLeftCorner(of_points, size) * others +
                               points * whole.tail(of_points) + gradient.tail(of_points);
  EXPECT_LT(left.norm(), 1e-8 * (all.bottomLeftCorner(of_points, size) * others).norm());
  const Eigen::VectorXd change = J * whole;
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    EXPECT_LT(
        (equations.Change(i, step) - change.segment<2>(2 * static_cast<Eigen::Index>(i))).norm(),
        1e-9 * change.norm());
  }
}

TEST(CameraEquations, AreThePlainOnesWithoutThePoints) {
  ExpectThePlainEquations<kNumOfPose>(ProblemOfTwoCameras());
  ExpectThePlainEquations<kNumOfPoseAndVelocity>(ProblemOfRollingShutter());
}

// Gauge, fixed parameters and images that see nothing do not move.
TEST(CameraEquations, HoldWhatIsNotVaried) {
  CameraProblem problem = ProblemOfRollingShutter();
  ParameterFlags fixed = ParameterFlags::Constant(false);
  fixed[kCx] = true;
  problem.FixAtPrior(fixed);
  CameraEquations<kNumOfPoseAndVelocity> equations(problem);
  Eigen::MatrixXd matrix = equations.Eliminate(0);
  equations.AddPriors(matrix);
  equations.Hold(matrix);
  Eigen::VectorXd gradient = Eigen::VectorXd::Ones(equations.size());
  equations.Hold(gradient);
  const Eigen::VectorXd step = matrix.selfadjointView<Eigen::Lower>().llt().solve(gradient);
  ASSERT_EQ(problem.held_images().size(), 1U);
  ASSERT_EQ(problem.held_coordinates().size(), 1U);
  EXPECT_TRUE(step.segment<6>(equations.RowOfImage(problem.held_images().front())).isZero(0));
  const CameraProblem::HeldCoordinate held = problem.held_coordinates().front();
  EXPECT_EQ(step[equations.RowOfImage(held.image) + held.coordinate], 0);
  EXPECT_EQ(step[equations.RowOfCamera(0) + kCx], 0);
  EXPECT_NE(step[equations.RowOfCamera(0) + kCy], 0);
  EXPECT_TRUE(step.allFinite());
}

}  // namespace
}  // namespace mono3d::calibration
