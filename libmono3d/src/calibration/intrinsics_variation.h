// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <vector>

#include "calibration/camera_problem.h"
#include "mono3d/calibration/camera_calibration.h"
#include "mono3d/geometry/camera_model.h"
#include "mono3d/image/sparse_model.h"

namespace mono3d::calibration {

// How much better each image of a camera alone is explained by a principal point and a focal length
// of its own, its pose free as well, the points as they were adjusted. What is within chance, or
// within what good calibrations are off by, is 0.
IntrinsicsVariation MeasureIntrinsicsVariation(const CameraProblem& problem,
                                               std::size_t of_camera = 0);

// IntrinsicsVariation::focal_drift of footage whose one camera was found to be `camera`: poses,
// points and a focal length for each stretch of the images, in their order, are adjusted together.
double MeasureFocalDrift(std::vector<SparseModel> maps, const CameraModel& camera);

}  // namespace mono3d::calibration
