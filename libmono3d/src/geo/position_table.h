// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "mono3d/geo/position_track.h"

namespace mono3d {

// The forms below are described at ReadPositionFile. `path` is for messages.

// Whether the first line names the columns of latitude and longitude.
bool IsPositionTable(const std::vector<std::string>& lines);
PositionTrack ParsePositionTable(const std::filesystem::path& path,
                                 const std::vector<std::string>& lines);

// geo.txt of OpenDroneMap: the coordinate system, then "image x y [z ...]".
bool IsImagePositionList(const std::vector<std::string>& lines);
PositionTrack ParseImagePositionList(const std::filesystem::path& path,
                                     const std::vector<std::string>& lines);

// gps.txt: numbers alone, geodetic or from an origin.
bool IsPositionList(const std::vector<std::string>& lines);
PositionTrack ParsePositionList(const std::filesystem::path& path,
                                const std::vector<std::string>& lines);

}  // namespace mono3d
