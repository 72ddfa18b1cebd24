// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "io/video_subtitles.h"
#include "mono3d/geo/position_track.h"

namespace mono3d {

// Whether the lines are those of subtitles: a number, then a time, or telemetry without times.
bool IsSubtitleFile(const std::vector<std::string>& lines);

// The positions in the subtitles that drones of DJI write beside their videos; see
// ReadPositionFile. `path` is for messages.
PositionTrack ParseDjiTelemetry(const std::filesystem::path& path,
                                const std::vector<std::string>& lines);

// The same of the subtitles in a video.
PositionTrack ParseDjiTelemetry(const std::filesystem::path& video,
                                const std::vector<VideoSubtitle>& subtitles);

}  // namespace mono3d
