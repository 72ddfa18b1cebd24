// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reconstruct/output_options.h"

#include <string>
#include <utility>
#include <vector>

#include "common/one_of.h"
#include "mono3d/pipeline/georeferencing.h"

namespace mono3d::tools {
namespace {

// A run writes many, and a picture of half the size takes a quarter of the time.
constexpr int kPreviewStep_px = 2;

}  // namespace

void AddOutputOptions(CLI::App& app, OutputArguments& arguments) {
  const std::vector<std::pair<std::string, ImagePlacing>> placings = {
      {"link", ImagePlacing::kLink}, {"copy", ImagePlacing::kCopy}, {"none", ImagePlacing::kNone}};
  app.add_option("--images", arguments.images,
                 "images/ beside sparse/, of the keyframes as they were taken, for COLMAP: link "
                 "(default; frames of a video and HEIC are written as JPEG), copy or none")
      ->transform(OneOf(placings))
      ->type_name("TEXT:{link,copy,none}");
  const std::vector<std::pair<std::string, DepthFileForm>> forms = {
      {"none", DepthFileForm::kNone},
      {"pfm", DepthFileForm::kPfm},
      {"exr", DepthFileForm::kExr},
      {"png16", DepthFileForm::kPng16}};
  app.add_option("--depth-files", arguments.depth_files,
                 "depth maps on the disk: pfm (default; 32-bit floats), exr (the same compressed), "
                 "png16 (16 bits, depth = value / scale.txt) or none")
      ->transform(OneOf(forms))
      ->type_name("TEXT:{none,pfm,exr,png16}");
  app.add_flag(
      "--depth-previews,!--no-depth-previews", arguments.depth_previews,
      "pictures of the depth maps beside them, of half the size; without it they are there but in "
      "live runs");
  const std::vector<std::pair<std::string, bool>> axes = {{"level", true}, {"first-camera", false}};
  app.add_option("--axes", arguments.is_level,
                 "axes of everything that is written: level (default; z up, the origin on the "
                 "ground) or first-camera")
      ->transform(OneOf(axes))
      ->type_name("TEXT:{level,first-camera}");
}

DepthFileOptions DepthFilesOf(const OutputArguments& arguments, bool is_live) {
  const bool is_told = arguments.depth_previews != 0;
  return {.form = arguments.depth_files,
          .with_previews = is_told ? arguments.depth_previews > 0 : !is_live,
          .preview_step_px = kPreviewStep_px};
}

std::optional<PipelinePositions> PositionsFor(const PlaceOfRun& place) {
  if (!place.positions && !place.control) return std::nullopt;
  return PipelinePositions{place.positions.value_or(PositionTrack{}), place.georeference,
                           place.turn_deg, place.control};
}

void ChooseAxes(const OutputArguments& arguments, const std::optional<WorldAxes>& saved_axes,
                const PlaceOfRun& place, Reconstruction& reconstruction) {
  for (MapReconstruction& map : reconstruction.maps) {
    if (saved_axes && map.map_id == 0) {
      MoveInto(*saved_axes, map);
      continue;
    }
    if (const auto positions = PositionsFor(place)) PlaceOnEarth(*positions, map);
    if (!map.georeference && arguments.is_level) {
      MoveInto(ChooseWorldAxes(map, place.turn_deg), map);
    }
  }
}

}  // namespace mono3d::tools
