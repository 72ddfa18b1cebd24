// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/core/export.h"
#include "mono3d/geometry/point_cloud.h"
#include "mono3d/geometry/similarity.h"

namespace MONO3D_EXPORT mono3d {

// The cloud in frame a: points moved, normals turned, radii scaled, the rest as it is.
PointCloud TransformCloud(const Similarity& S_a_b, const PointCloud& cloud_b);

}  // namespace mono3d
