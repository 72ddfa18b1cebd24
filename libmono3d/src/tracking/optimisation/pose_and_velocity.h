// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "mono3d/geometry/rolling_shutter.h"
#include "tracking/optimisation/pose_optimisation.h"
#include "tracking/velocity_prior.h"

namespace mono3d::tracking {

struct PoseAndVelocity {
  PoseEstimate pose;  // at the middle line
  CameraVelocity velocity;
};

// The pose and the velocity of least reprojection error of an image whose lines were read one after
// the other by `sensor`: pixels are as it shows them. Rounds and outliers as in OptimisePose. The
// prior keeps the twelve unknowns apart where few points, or points on few lines, do not. A linear
// velocity far outside of it is held at its mean, where the points fit then as well.
PoseAndVelocity OptimisePoseAndVelocity(const CameraModel& camera, const CameraModel& sensor,
                                        const Pose& T_cam_world, const VelocityPrior& prior,
                                        const std::vector<PointMeasurement>& measurements);

}  // namespace mono3d::tracking
