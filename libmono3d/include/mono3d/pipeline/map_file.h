// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/pipeline/reconstruction.h"
#include "mono3d/tracking/tracker.h"

namespace MONO3D_EXPORT mono3d {

// Tracker::SaveMap and Tracker::LoadMap with a file. `keyframes` are those of the map in the axes
// that the run was written in: the file keeps these axes, so that a later run is written in them
// too. None: those of the tracker. Throw Error as Tracker does, and when the file cannot be written
// or read.
void SaveMapFile(const Tracker& tracker, const std::filesystem::path& path,
                 const std::vector<TrajectoryEntry>& keyframes = {});
// The axes that the map was saved with, of map 0 from now on.
WorldAxes LoadMapFile(Tracker& tracker, const std::filesystem::path& path);

}  // namespace mono3d
