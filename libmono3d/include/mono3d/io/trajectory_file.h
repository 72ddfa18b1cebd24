// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/geometry/stamped_pose.h"

namespace MONO3D_EXPORT mono3d {

// The form of the TUM RGB-D benchmark: a line "timestamp tx ty tz qx qy qz qw" for each pose,
// camera to world; lines that begin with # are comments. Throws Error with file and line when a
// line has other content or its quaternion is not of unit length (within the rounding of three
// printed digits). The lines may be in any order of time, and there may be none.
std::vector<StampedPose> ReadTrajectory(const std::filesystem::path& path);

// Every number survives.
void WriteTrajectory(const std::filesystem::path& path, const std::vector<StampedPose>& poses);

}  // namespace mono3d
