// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

#include "calibration/board_detection.h"
#include "calibration/camera_parameters.h"
#include "mono3d/calibration/camera_calibration.h"
#include "mono3d/geometry/camera_prior.h"

namespace mono3d::calibration {

// Of a board in the camera's frame: rotation vector and translation in squares.
using BoardPose = std::array<double, 6>;

// The views of one board, and the camera and poses that explain them.
struct BoardProblem {
  CameraPrior prior;
  std::vector<BoardView> views;
  CameraModel camera;
  std::vector<BoardPose> poses = {};  // of each view
};

// How far the corners of a view lie from where the camera shows them, in px: x and y of each.
struct BoardErrors {
  Eigen::VectorXd observed_less_computed;
  Eigen::Matrix<double, Eigen::Dynamic, 6> by_pose;  // derivatives of what is computed
  Eigen::Matrix<double, Eigen::Dynamic, kNumParameters> by_camera;
};
BoardErrors ErrorsOf(const CameraModel& camera, const BoardView& view, const BoardPose& pose);

std::vector<CalibrationResidual> ResidualsOf(const BoardProblem& problem, std::size_t index);
double SumOfSquares(const BoardProblem& problem);

// The least squares of one view's errors, from `pose` on.
BoardPose RefinePose(const CameraModel& camera, const BoardView& view, const BoardPose& pose);
// Of all views, for the camera as it is.
void SolvePoses(BoardProblem& problem);

}  // namespace mono3d::calibration
