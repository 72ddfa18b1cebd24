// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "mono3d/geometry/camera_model.h"

namespace mono3d {

// Does the first line that is no comment look like one of COLMAP's cameras.txt?
bool IsColmapCameras(const std::vector<std::string>& lines);

// All cameras of a cameras.txt, by their ids. Throws Error with file and line.
std::map<std::int64_t, CameraModel> ParseAllColmapCameras(const std::filesystem::path& path,
                                                          const std::vector<std::string>& lines);

// The only camera of a cameras.txt; see ReadCameraFile. Throws Error with file and line.
CameraModel ParseColmapCameras(const std::filesystem::path& path,
                               const std::vector<std::string>& lines);

}  // namespace mono3d
