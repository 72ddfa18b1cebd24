// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/board_problem.h"

#include <ceres/jet.h>
#include <ceres/rotation.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "calibration/parameter_projection.h"

namespace mono3d::calibration {

BoardErrors ErrorsOf(const CameraModel& camera, const BoardView& view, const BoardPose& pose) {
  constexpr int kNumPose = 6;
  using Jet = ceres::Jet<double, kNumPose + kNumParameters>;
  const ParameterVector parameters = ToParameters(camera);
  std::array<Jet, kNumPose> pose_jets;
  std::array<Jet, kNumParameters> camera_jets;
  for (std::size_t i = 0; i < pose_jets.size(); ++i)
    pose_jets[i] = Jet(pose[i], static_cast<int>(i));
  for (std::size_t i = 0; i < camera_jets.size(); ++i) {
    const auto k = static_cast<int>(i);
    camera_jets[i] = Jet(parameters[k], kNumPose + k);
  }
  const auto num_rows = static_cast<Eigen::Index>(2 * view.corners.size());
  BoardErrors errors;
  errors.observed_less_computed.resize(num_rows);
  errors.by_pose.resize(num_rows, Eigen::NoChange);
  errors.by_camera.resize(num_rows, Eigen::NoChange);
  for (std::size_t i = 0; i < view.corners.size(); ++i) {
    const cv::Point3f& corner = view.corners[i];
    const std::array<Jet, 3> p_board = {Jet(corner.x), Jet(corner.y), Jet(corner.z)};
    std::array<Jet, 3> p_cam;
    ceres::AngleAxisRotatePoint(pose_jets.data(), p_board.data(), p_cam.data());
    for (std::size_t k = 0; k < 3; ++k) p_cam[k] += pose_jets[3 + k];
    std::array<Jet, 2> pixel;
    ProjectParameters(camera.lens, camera_jets.data(), p_cam.data(), pixel.data());
    const std::array<double, 2> observed = {view.pixels[i].x, view.pixels[i].y};
    for (std::size_t k = 0; k < 2; ++k) {
      const auto row = static_cast<Eigen::Index>(2 * i + k);
      errors.observed_less_computed[row] = observed[k] - pixel[k].a;
      errors.by_pose.row(row) = pixel[k].v.head<kNumPose>();
      errors.by_camera.row(row) = pixel[k].v.tail<kNumParameters>();
    }
  }
  return errors;
}

std::vector<CalibrationResidual> ResidualsOf(const BoardProblem& problem, std::size_t index) {
  const BoardView& view = problem.views[index];
  const Eigen::VectorXd errors =
      ErrorsOf(problem.camera, view, problem.poses[index]).observed_less_computed;
  std::vector<CalibrationResidual> residuals;
  for (std::size_t i = 0; i < view.pixels.size(); ++i) {
    residuals.push_back({{view.pixels[i].x, view.pixels[i].y},
                         errors.segment<2>(static_cast<Eigen::Index>(2 * i))});
  }
  return residuals;
}

double SumOfSquares(const BoardProblem& problem) {
  double sum = 0;
  for (std::size_t i = 0; i < problem.views.size(); ++i) {
    sum += ErrorsOf(problem.camera, problem.views[i], problem.poses[i])
               .observed_less_computed.squaredNorm();
  }
  return sum;
}

// Levenberg and Marquardt.
BoardPose RefinePose(const CameraModel& camera, const BoardView& view, const BoardPose& pose) {
  constexpr int kMaxSteps = 30;
  constexpr double kConverged = 1e-12;  // relative gain
  constexpr double kMaxDamping = 1e6;
  double damping = 1e-3;
  BoardPose best = pose;
  BoardErrors errors = ErrorsOf(camera, view, best);
  for (int i = 0; i < kMaxSteps && damping < kMaxDamping; ++i) {
    const double before = errors.observed_less_computed.squaredNorm();
    Eigen::Matrix<double, 6, 6> normal = errors.by_pose.transpose() * errors.by_pose;
    normal.diagonal() *= 1 + damping;
    const Eigen::Matrix<double, 6, 1> step =
        normal.ldlt().solve(errors.by_pose.transpose() * errors.observed_less_computed);
    BoardPose moved = best;
    for (std::size_t k = 0; k < moved.size(); ++k) moved[k] += step[static_cast<Eigen::Index>(k)];
    BoardErrors after = ErrorsOf(camera, view, moved);
    const double gain = before - after.observed_less_computed.squaredNorm();
    if (!(gain >= 0)) {  // not a number fails as well
      damping *= 10;
      continue;
    }
    best = moved;
    errors = std::move(after);
    damping /= 10;
    if (gain <= kConverged * before) break;
  }
  return best;
}

void SolvePoses(BoardProblem& problem) {
  for (std::size_t i = 0; i < problem.views.size(); ++i) {
    problem.poses[i] = RefinePose(problem.camera, problem.views[i], problem.poses[i]);
  }
}

}  // namespace mono3d::calibration
