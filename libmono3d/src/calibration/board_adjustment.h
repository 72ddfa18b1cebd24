// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <span>

#include "calibration/board_detection.h"
#include "calibration/camera_adjustment.h"

namespace mono3d::calibration {

// The camera that shows the views of one board, from FindStart on and drawn to `prior`.
// Views that fit three times worse than the others are left out: blurred, or found wrongly. A
// parameter that the views do not determine, or that explains no more than its own chance, stays
// where the prior has it.
// With fewer than three views nothing is adjusted, and where the views leave the focal length open.
//
// The covariance is the inverse of the information, with the variance of the residuals, and larger
// where the residuals of a view are not independent of each other (a bent board, motion blur): by
// the overdispersion of the views' gradients.
CameraAdjustment AdjustBoardCamera(CameraPrior prior, std::span<const BoardView> views);

}  // namespace mono3d::calibration
