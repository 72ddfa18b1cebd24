// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/geometry/geodetic.h"
#include "mono3d/products/textured_mesh.h"

namespace MONO3D_EXPORT mono3d {

// Of a mesh with textures, for those who open its files.
struct MeshFileOptions {
  int jpeg_quality = 92;  // 1 to 100; 92 is 40 dB and more
  // Where the axes x east, y north, z up (metres) begin; nothing: axes and unit are the run's own.
  std::optional<Geodetic> origin;
};

// Writes a binary glTF 2.0 file (.glb), textures within as JPEG. Materials are unlit: images have
// the light of the day in them. glTF has y up: a node turns the axes, x east, y north, z up.
// Origin, axes and unit are in asset.extras. Throws Error on a mesh whose lists do not fit
// together, on one that is larger than the form allows (4 GB), and where the file cannot be
// written.
void WriteGlb(const std::filesystem::path& file, const TexturedMesh& mesh,
              const MeshFileOptions& options = {});

// Writes a Wavefront file (.obj), beside it NAME.mtl and NAME_N.jpg, the textures. Axes are the
// mesh's own. Returns all of them. Throws Error as above.
std::vector<std::filesystem::path> WriteObj(const std::filesystem::path& file,
                                            const TexturedMesh& mesh,
                                            const MeshFileOptions& options = {});

// Throws Error when lists of the mesh differ in length or a triangle names a vertex that is not
// there. `where` names the mesh in the message.
void Validate(const TexturedMesh& mesh, const std::string& where);

}  // namespace mono3d
