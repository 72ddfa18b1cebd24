// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>

#include "mono3d/core/export.h"
#include "mono3d/products/map_surfels.h"

namespace MONO3D_EXPORT mono3d {

// Writes a model as LAS 1.4 (ASPRS, R15), point format 7: coordinates in steps below a tenth of the
// radius of the surfels, colours of 16 bits, and as extra bytes what the model has of: confidence
// (float, 0 to 1), radius (float, units of the map), NormalX, NormalY, NormalZ (floats). The
// coordinate system, where there is one, is in it as WKT. Throws Error (kIo) where it cannot be
// written.
void WriteLas(const std::filesystem::path& path, MapSurfels& surfels, const MapAxes& axes);

// Writes a model as PLY in the axes of the map, in the form of model.ply, less a whole offset that
// comments of the header tell: single precision does not hold map coordinates. Throws Error (kIo).
void WriteLocalPly(const std::filesystem::path& path, MapSurfels& surfels, const MapAxes& axes);

}  // namespace mono3d
