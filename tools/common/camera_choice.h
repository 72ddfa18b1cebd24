// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "mono3d/calibration/camera_calibration.h"
#include "mono3d/geometry/camera_model.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/pipeline/reconstruction.h"

namespace mono3d::tools {

inline constexpr const char* kAutomaticLens = "auto";

// Where the camera of a run comes from.
struct CameraArguments {
  std::string file;                   // a calibration; empty: none is known
  bool is_held = false;               // the calibration is not to be doubted
  std::string lens = kAutomaticLens;  // or "pinhole" or "fisheye"
  CalibrationOptions calibration;
};

struct CameraChoice {
  CameraModel camera;                            // of the images as they are read, before --resize
  std::optional<CameraCalibration> calibration;  // where the images were asked
};

// Adds --lens.
void AddLensOption(CLI::App& app, CameraArguments& arguments);

// What is known of the camera of `input`: the file, or what photos or the telemetry of a video say
// of their camera, or the default. Metadata tell nothing of fisheye lenses. Throws UsageError where
// the file has another lens than was asked for.
CameraPrior FindPrior(const std::string& input, const CameraArguments& arguments);

// ReadShownTurn of the images; says on stdout where that is not 0.
int TellOfTurn(const std::string& input);

// Opens `input`, or a part of what `source` takes of it.
FootageOpener OpenerOf(const std::string& input, const FrameSourceOptions& source);

// The camera of the file where it is held; else what the images say, beginning with the file, or
// with what photos or the telemetry of a video say of their camera, or with the default. `photos`:
// of photographs in any order, whose `positions` have a say then; null: of a video.
CameraChoice ChooseCamera(const std::string& input, const FrameSourceOptions& source,
                          const CameraArguments& arguments,
                          const PhotoMapperOptions* photos = nullptr,
                          const PositionsOfMap& positions = {});

// One line for people: "focal length 1021.3 +- 0.8 px (was 1100.0 from EXIF)". Empty where the
// images agree with the calibration.
std::string CameraLine(const CameraCalibration& calibration);

// For people, where the camera is not the same in all images; else empty.
std::string VariationText(const IntrinsicsVariation& variation);

// CameraLine of a live run: "..., adopted at frame 214", or why it was not.
std::string CameraLine(const SelfCalibration& self_calibration);

}  // namespace mono3d::tools
