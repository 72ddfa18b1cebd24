// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "mono3d/geo/position_track.h"

namespace mono3d {

// Whether one of the first lines is an NMEA sentence: "$GPGGA,...*47".
bool IsNmeaFile(const std::vector<std::string>& lines);

// See ReadPositionFile. `path` is for messages.
PositionTrack ParseNmea(const std::filesystem::path& path, const std::vector<std::string>& lines);

}  // namespace mono3d
