// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>

#include "mono3d/core/export.h"
#include "mono3d/geometry/point_cloud.h"

namespace MONO3D_EXPORT mono3d {

// Writes surfels as 3D Gaussians, in the binary PLY form of Kerbl et al. 2023 (float x y z,
// nx ny nz, f_dc_0..2, opacity, scale_0..2, rot_0..3): a Gaussian has the centre, the plane and the
// spread of its surfel's disc, a tenth of that across it, its colour from all sides, and its
// confidence as opacity. A start for those who train splats, and to be looked at as it is. Throws
// Error when the cloud is empty, lacks normals, radii or colours, or holds numbers that are not
// finite or radii that are not positive.
void WriteSplats(const std::filesystem::path& file, const PointCloud& surfels);
// The same of model.ply, block by block, however large. Throws Error (kIo) as well.
void WriteSplatsOf(const std::filesystem::path& model, const std::filesystem::path& file);

}  // namespace mono3d
