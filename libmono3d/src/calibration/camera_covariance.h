// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "calibration/camera_parameters.h"
#include "calibration/camera_problem.h"

namespace mono3d::calibration {

// Of the camera's parameters at the solution of `problem`, over all poses and points. Zero where
// they are fixed. O(points * images per point^2 + images^3).
ParameterMatrix CameraCovariance(const CameraProblem& problem);

}  // namespace mono3d::calibration
