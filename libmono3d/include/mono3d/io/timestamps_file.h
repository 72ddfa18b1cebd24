// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <vector>

#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

// One time in seconds a line, each larger than the one before: timestamps.txt of a sequence's
// folder, times.txt of KITTI. Lines that begin with # are comments. Throws Error with file and
// line.
std::vector<double> ReadTimestamps(const std::filesystem::path& path);

}  // namespace mono3d
