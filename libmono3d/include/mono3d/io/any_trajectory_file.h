// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/geometry/stamped_pose.h"

namespace MONO3D_EXPORT mono3d {

enum class TrajectoryForm { kTum, kKitti, kColmap };

// How poses without a time get one.
struct TrajectoryTimes {
  // KITTI: the time of line i, from 0. COLMAP: of the image whose name holds the number i, where
  // time_of_image_s does not name it. Empty: i / fps.
  std::vector<double> timestamps_s;
  double fps = 30;
  // COLMAP: times by the name of the image, as it stands in the file.
  std::map<std::string, double> time_of_image_s;
};

// The form of a trajectory file, from its first line that is no comment: 8 numbers: TUM; 12
// numbers: KITTI (a 3x4 matrix, camera to world, row by row); an identity, 7 numbers, an identity
// and a name: COLMAP's images.txt. Throws Error with file and line when it is none of these. A file
// without poses counts as TUM.
TrajectoryForm DetectTrajectoryForm(const std::filesystem::path& path);

// Reads a trajectory of any of the three forms, in the order of the file. COLMAP's poses are world
// to camera, w first; they are turned around. The time of an image without a time of its own comes
// from the last number in the stem of its name ("cam0/frame_000123.jpg": 123).
// Throws Error with file and line when a line has other content, when a rotation is not one, and
// when there is no time for a pose.
std::vector<StampedPose> ReadAnyTrajectory(const std::filesystem::path& path,
                                           const TrajectoryTimes& times = {});

}  // namespace mono3d
