// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "calibration/camera_parameters.h"
#include "calibration/camera_problem.h"

namespace mono3d::calibration {

// What is known of a camera's parameters. Zero where they are fixed.
struct CameraCovariance {
  ParameterMatrix clustered;    // errors are alike within stretches of images and of one point
  ParameterVector independent;  // variances, were all errors independent
};

// Of each camera's at the solution of `problem`, over all poses, points and other cameras.
// O(points * images per point^2 + images^3).
std::vector<CameraCovariance> CameraCovariances(const CameraProblem& problem);

}  // namespace mono3d::calibration
