// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>

#include "mono3d/core/export.h"
#include "mono3d/geometry/triangle_mesh.h"

namespace MONO3D_EXPORT mono3d {

// Writes a binary little-endian PLY file: vertices with float x y z, float nx ny nz and, where the
// mesh has colours, uchar red green blue; faces with a list vertex_indices (uchar count, uint).
// ReadPly reads its vertices. Throws Error when lists of the mesh differ in length.
void WriteMeshPly(const std::filesystem::path& path, const TriangleMesh& mesh);

// Reads vertices as ReadPly does, and triangles that follow them as a list vertex_indices or
// vertex_index of any types; normals and colours are empty where the file has none. Throws Error
// on another form, on faces of more or fewer corners, and when a vertex is not there.
TriangleMesh ReadMeshPly(const std::filesystem::path& path);

}  // namespace mono3d
