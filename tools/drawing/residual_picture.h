// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>
#include <span>

#include "mono3d/calibration/camera_calibration.h"
#include "mono3d/geometry/camera_model.h"

namespace mono3d::tools {

// What the model of a camera leaves unexplained, as pictures (CV_8UC3). Both show medians of many
// residuals, which the outliers of a robust adjustment do not move.

// Where in the image: an arrow for each cell, enlarged, red where it is more than chance. Cells
// with fewer than five observations are grey.
cv::Mat ResidualFieldPicture(std::span<const CalibrationResidual> residuals,
                             const CameraModel& camera);

// Away from the principal point and across, by the distance from it, with two standard errors.
cv::Mat ResidualByRadiusPicture(std::span<const CalibrationResidual> residuals,
                                const CameraModel& camera);

}  // namespace mono3d::tools
