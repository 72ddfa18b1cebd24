// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <CLI/CLI.hpp>
#include <optional>

#include "mono3d/geo/georeference.h"
#include "mono3d/geo/ground_control.h"
#include "mono3d/geo/position_track.h"
#include "mono3d/io/depth_map_files.h"
#include "mono3d/pipeline/images_of_run.h"
#include "mono3d/pipeline/stages.h"
#include "mono3d/pipeline/world_axes.h"

namespace mono3d::tools {

// In what form a run is written.
struct OutputArguments {
  ImagePlacing images = ImagePlacing::kLink;
  DepthFileForm depth_files = DepthFileForm::kPfm;
  int depth_previews = 0;  // 1: write them; -1: do not; 0: where the run is not live
  bool is_level = true;    // z up; else the axes of the first camera
};

DepthFileOptions DepthFilesOf(const OutputArguments& arguments, bool is_live);

// Where the images of a run were, and how they are held.
struct PlaceOfRun {
  int turn_deg = 0;  // of the images when they are shown
  std::optional<PositionTrack> positions;
  GeoreferenceOptions georeference;
  std::optional<GroundControl> control = {};
};

// For the pipeline, where there are positions or ground control points.
std::optional<PipelinePositions> PositionsFor(const PlaceOfRun& place);

// Brings the maps into the axes that they are written in: of map 0, `saved_axes` where a map was
// loaded; those of the earth where the positions determine them; else those asked for.
void ChooseAxes(const OutputArguments& arguments, const std::optional<WorldAxes>& saved_axes,
                const PlaceOfRun& place, Reconstruction& reconstruction);

void AddOutputOptions(CLI::App& app, OutputArguments& arguments);

}  // namespace mono3d::tools
