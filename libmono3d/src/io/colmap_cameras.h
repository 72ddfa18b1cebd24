// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "mono3d/geometry/camera_model.h"

namespace mono3d {

// A camera as COLMAP's files have it.
struct ColmapCamera {
  const char* model = "";
  std::int32_t model_id = 0;
  std::vector<double> params;  // pixel (0, 0) is a corner
};
// A PINHOLE without distortion, an OPENCV camera without k3, an OPENCV_FISHEYE one with a fisheye
// lens, and else a FULL_OPENCV one.
ColmapCamera ToColmapCamera(const CameraModel& camera);

// Does the first line that is no comment look like one of COLMAP's cameras.txt?
bool IsColmapCameras(const std::vector<std::string>& lines);

// All cameras of a cameras.txt, by their ids. Throws Error with file and line.
std::map<std::int64_t, CameraModel> ParseAllColmapCameras(const std::filesystem::path& path,
                                                          const std::vector<std::string>& lines);

// The only camera of a cameras.txt; see ReadCameraFile. Throws Error with file and line.
CameraModel ParseColmapCameras(const std::filesystem::path& path,
                               const std::vector<std::string>& lines);

// The same of a cameras.bin.
bool IsColmapBinaryCameras(std::string_view bytes);
CameraModel ParseColmapBinaryCameras(const std::filesystem::path& path, std::string_view bytes);

}  // namespace mono3d
