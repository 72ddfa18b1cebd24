// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>

#include "mono3d/core/export.h"
#include "mono3d/tracking/tracker.h"

namespace MONO3D_EXPORT mono3d {

// Tracker::SaveMap and Tracker::LoadMap with a file. Throw Error as these do, and when the file
// cannot be written or read.
void SaveMapFile(const Tracker& tracker, const std::filesystem::path& path);
void LoadMapFile(Tracker& tracker, const std::filesystem::path& path);

}  // namespace mono3d
