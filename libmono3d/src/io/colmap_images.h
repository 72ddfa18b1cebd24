// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "mono3d/geometry/pose.h"

namespace mono3d {

// A point as a line of COLMAP's images.txt lists it.
struct ColmapObservation {
  Eigen::Vector2d pixel;  // (0, 0) is a corner of the top-left pixel
  std::int64_t point_id = -1;
};

struct ColmapImage {
  std::int64_t id = 0;
  std::int64_t camera_id = 0;
  Pose T_world_cam;
  std::string name;
  std::string where;  // file and line, for messages
  std::vector<ColmapObservation> observations;
};

// Does the line, cut into words, look like the first line of an image in COLMAP's images.txt?
bool IsColmapImage(const std::vector<std::string_view>& words);

// The images of an images.txt. Throws Error with file and line.
std::vector<ColmapImage> ParseColmapImages(const std::filesystem::path& path,
                                           const std::vector<std::string>& lines);

}  // namespace mono3d
