// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "mono3d/io/any_trajectory_file.h"

namespace mono3d {

// Both throw Error with file and line; see ReadAnyTrajectory.
std::vector<StampedPose> ParseKittiTrajectory(const std::filesystem::path& path,
                                              const std::vector<std::string>& lines,
                                              const TrajectoryTimes& times);
std::vector<StampedPose> ParseColmapTrajectory(const std::filesystem::path& path,
                                               const std::vector<std::string>& lines,
                                               const TrajectoryTimes& times);

// The number in a line at `where`, or Error.
double ParsePoseValue(std::string_view word, const std::string& where);
// Throws Error when the quaternion of a pose at `where` is not of unit length, but for rounding.
void RequireUnitLength(const Eigen::Quaterniond& rotation, const std::string& where);
// The time of the pose with this number.
double TimeOfPose(std::size_t number, const TrajectoryTimes& times, const std::string& where);

}  // namespace mono3d
