// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <string>

#include "mono3d/pipeline/next_views.h"
#include "mono3d/pipeline/reconstruction.h"

namespace mono3d::tools {

// The flight and where to fly next, in WGS 84, for Google Earth, QGIS and ground stations; KML 2.2.
// Heights are as the positions had them: above the sea or the ellipsoid, or above the place of
// take-off. The map must be on the earth (georeference). `is_path`: its frames follow one another;
// else they are photographs, and each is a point.
std::string NextViewsKml(const MapReconstruction& map, const NextViews& next, bool is_path);

// next_views.kml; nothing of a map that is not on the earth. Throws Error when it cannot be
// written.
void WriteNextViewsKml(const std::filesystem::path& folder, const MapReconstruction& map,
                       const NextViews& next, bool is_path);

}  // namespace mono3d::tools
