// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/core/export.h"
#include "mono3d/geometry/point_cloud.h"

namespace MONO3D_EXPORT mono3d {

// One point for all that lie in one cell of a grid with edges of `voxel_su`, in the order of their
// first points: position, normal and colour are means by confidence (by number where the cloud has
// none), confidence and observations the largest; radii are at least such that neighbouring discs
// close the surface. Throws Error unless the edge is positive and the lists of the cloud are
// equally long.
PointCloud ThinToVoxels(const PointCloud& cloud, double voxel_su);

}  // namespace mono3d
