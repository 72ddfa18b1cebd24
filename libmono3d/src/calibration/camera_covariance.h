// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "calibration/camera_parameters.h"
#include "calibration/camera_problem.h"

namespace mono3d::calibration {

// What is known of a camera's parameters. Zero where they are fixed.
struct CameraCovariance {
  // Errors are alike within stretches of images and of one point. Larger by what is not known of
  // their size, so that 95 % lie within two standard deviations.
  ParameterMatrix clustered;
  // Variances that errors alike in all images could hide, which more images do not reduce: see
  // kLeftOutShare.
  ParameterVector hidden;
};

// What the model leaves out (other distortion, the shutter) is taken for a tenth of the residuals,
// and may be alike in all images: what changes their variance by no more than a hundredth, with all
// else fitted to it, could be that.
inline constexpr double kLeftOutShare = 0.1;

// Of each camera's at the solution of `problem`, over all poses, points and other cameras.
// O(points * images per point^2 + images^3).
std::vector<CameraCovariance> CameraCovariances(const CameraProblem& problem);

}  // namespace mono3d::calibration
