// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "calibration/camera_parameters.h"
#include "calibration/camera_problem.h"

namespace mono3d::calibration {

// Of each camera's parameters at the solution of `problem`, over all poses, points and other
// cameras. Zero where they are fixed. O(points * images per point^2 + images^3).
std::vector<ParameterMatrix> CameraCovariances(const CameraProblem& problem);

}  // namespace mono3d::calibration
