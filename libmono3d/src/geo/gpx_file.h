// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <string>

#include "mono3d/geo/position_track.h"

namespace mono3d {

// See ReadPositionFile. `path` is for messages.
PositionTrack ParseGpx(const std::filesystem::path& path, const std::string& xml);

}  // namespace mono3d
