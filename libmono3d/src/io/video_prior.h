// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include "mono3d/geometry/camera_prior.h"

namespace mono3d {

// The prior of the camera of a video file. Throws Error when not one frame can be read.
CameraPrior ReadVideoPrior(const std::filesystem::path& video);

// What the telemetry of a video says of the focal length in 35 mm film.
struct TelemetryFocal {
  double focal_35mm = 0;     // of the first entry that has one
  bool is_changing = false;  // other entries have others: the lens zooms
};

// `text` is of a subtitle file as DJI's drones write it: "[focal_len: 24.00]" are mm, and
// "[focal_len : 240]", without a decimal point, tenths of them. Nothing when no entry has a
// plausible one.
std::optional<TelemetryFocal> ParseTelemetryFocal(std::string_view text);

}  // namespace mono3d
