// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "mono3d/geo/ground_control.h"
#include "mono3d/geo/ground_control_file.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/pipeline/reconstruction.h"

namespace mono3d::tools {

// Points that were surveyed on the ground and marked in the images.
struct GroundControlArguments {
  std::string file;          // empty: none
  std::string check_points;  // names, with commas between them
  GroundControlOptions options;
};

void AddGroundControlOptions(CLI::App& app, GroundControlArguments& arguments);

// The file's points; nothing where none was named. Throws Error where it cannot be read, where its
// coordinate system needs PROJ and there is none, and UsageError where a check point is not in it.
std::optional<GroundControl> ReadGroundControl(const GroundControlArguments& arguments);

// Finds the images of the input that the points were marked in, and the lines of sight through
// their cameras. Says on stdout how many points and marks there are. Throws UsageError of a video:
// its images have no names. `are_frames`: the images are those of a video, and so each line of a
// rolling shutter has a pose of its own.
void FindSights(const std::string& input, const CamerasOfImages& cameras, bool are_frames,
                GroundControl& control);

// For the end of a run: "ground control: 5 of 6 points used, off by 2.1 cm, ...", and a line for
// each point that was not used. Empty without points.
std::string GroundControlLines(const MapReconstruction& map);

}  // namespace mono3d::tools
