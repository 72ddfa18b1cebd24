// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>

#include "mono3d/core/export.h"
#include "mono3d/geometry/point_cloud.h"

namespace MONO3D_EXPORT mono3d {

// Writes a binary little-endian PLY file with the properties that the cloud has, in this order:
// float x y z, float nx ny nz, uchar red green blue, float radius, float confidence,
// uint observations, uchar inferred, uint first_frame. Throws Error when the lists of the cloud
// differ in length.
void WritePly(const std::filesystem::path& path, const PointCloud& cloud);

// Reads the vertices of a binary little-endian PLY file: the properties above, of any scalar type
// and in any order; others are skipped, and so is what follows the vertices. Throws Error on
// another form and when the file ends too early.
PointCloud ReadPly(const std::filesystem::path& path);

}  // namespace mono3d
