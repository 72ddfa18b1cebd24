// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "calibration/camera_adjustment.h"
#include "mono3d/calibration/camera_calibration.h"

namespace mono3d::calibration {

// Is a parameter three standard deviations from where metadata have it?
bool IsFarFrom(const CameraPrior& prior, const CameraModel& camera);

// The same camera with the weight of one of which nothing is known.
CameraPrior WithoutWeight(const CameraPrior& prior);

// Writes the camera of the adjustment and what is known of it into the posterior.
void TakePosterior(const CameraAdjustment& adjustment, CameraCalibration& result);

// What was found in images of another size, brought to the size of `told`.
void BringToSize(const CameraPrior& told, CameraCalibration& result);

}  // namespace mono3d::calibration
