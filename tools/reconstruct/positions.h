// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>

#include "mono3d/geo/georeference.h"
#include "mono3d/geo/position_track.h"
#include "mono3d/pipeline/reconstruction.h"

namespace mono3d::tools {

// Where the cameras were, as the drone wrote it.
struct PositionArguments {
  std::string source = "auto";  // "auto", "none" or a file
  GeoreferenceOptions georeference;
};

void AddPositionOptions(CLI::App& app, PositionArguments& arguments);

// The positions for this input, and a line on stdout that says what they are. With "auto": those in
// the photographs, or beside the video; damage there is a warning, and nothing is an answer. Of a
// file that was named, every Error is thrown; live, where it is to come, it may have none yet.
std::optional<PositionTrack> FindPositions(const std::string& input,
                                           const PositionArguments& arguments, bool is_live);

// The file to watch in a live run: that which was named.
std::optional<std::filesystem::path> PositionsToWatch(const PositionArguments& arguments,
                                                      bool is_live);

// "scale +-0.21 %, heading +-0.4 degrees, ...", or why there is none; for the end of a run.
std::string GeoreferenceLine(const MapReconstruction& map);

}  // namespace mono3d::tools
