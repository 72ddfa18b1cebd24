// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "calibration/camera_adjustment.h"
#include "mono3d/calibration/camera_calibration.h"
#include "mono3d/image/camera_positions.h"
#include "mono3d/image/sparse_model.h"

namespace mono3d::calibration {

// Is a parameter three standard deviations from where metadata have it?
bool IsFarFrom(const CameraPrior& prior, const CameraModel& camera);

// The same camera with the weight of one of which nothing is known.
CameraPrior WithoutWeight(const CameraPrior& prior);

// The same prior with nothing free but the shutter.
CameraPrior WithLensHeld(const CameraPrior& prior);

// Gives the camera the lens of the one told, and what is known of it.
void TakeLens(const CameraPrior& told, CameraModel& camera);
void TakeLens(const CameraPrior& told, CameraPrior& posterior);

// Two rounds track the same footage with other keyframes and points, from other cameras. That of
// the last one is not known better than their difference says, whose variance is twice that of
// either.
CameraAdjustment WithDifference(CameraAdjustment adjustment, const CameraAdjustment& before);

// Writes the camera of the adjustment and what is known of it into the posterior.
void TakePosterior(const CameraAdjustment& adjustment, CameraCalibration& result);

// Those of each map that has any, its place in `maps` as map_id.
std::vector<CameraPositions> PositionsOf(const std::vector<SparseModel>& maps,
                                         const PositionsOfMap& positions);

// What was found in images of another size, brought to the size of `told`.
void BringToSize(const CameraPrior& told, CameraCalibration& result);

}  // namespace mono3d::calibration
