// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "calibration/board_problem.h"

namespace mono3d::calibration {

// Is it a camera that anybody builds?
bool IsPlausible(const CameraModel& camera);

// A camera and poses to adjust from. Without distortion, or with that of a pinhole camera: all
// parameters free, without the prior (cv::calibrateCamera). Of a fisheye lens: that of five focal
// lengths around the prior's whose poses fit the views best. Returns whether there is one.
bool FindStart(BoardProblem& problem);

}  // namespace mono3d::calibration
