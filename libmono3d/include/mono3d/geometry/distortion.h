// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>

#include "mono3d/core/export.h"
#include "mono3d/geometry/camera_model.h"

namespace MONO3D_EXPORT mono3d {

// The pixel at which a lens with distortion shows a point; z forward must be positive. The same as
// CameraModel::Project where there is none. Model: Brown 1971, in OpenCV's order k1 k2 p1 p2 k3.
Eigen::Vector2d ProjectDistorted(const CameraModel& camera, const Eigen::Vector3d& p_cam);

}  // namespace mono3d
