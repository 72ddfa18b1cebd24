// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <algorithm>
#include <array>
#include <string_view>

namespace mono3d::tools {

// The options of the modules that people set: --help lists these, --help-all the others as well.
inline constexpr std::array<std::string_view, 25> kCommonOptions = {
    // mono3d-reconstruct and mono3d-depth
    "tracking.max_side_px",
    "keyframes.num_images",
    "depth.pyramid.level",
    "depth.plane_sweep.min_depth_su",
    "depth.plane_sweep.max_depth_su",
    "fusion.max_surfels",
    "fusion.export.min_observations",
    "fusion.export.min_confidence",
    "fusion.export.gap_confidence",
    // mono3d-simulate
    "scene.kind",
    "scene.seed",
    "scene.with_water",
    "scene.num_moving_cars",
    "flight.kind",
    "flight.height_m",
    "flight.speed_m_per_s",
    "flight.duration_s",
    "flight.heading_deg",
    "flight.pitch_deg",
    "flight.radius_m",
    "camera.width",
    "camera.height",
    "camera.focal_px",
    "sensor.readout_s",
    "sensor.read_noise",
};

// Options without a dot are those of the tool itself; all but this one are common.
inline constexpr std::string_view kDeveloperOption = "validation";

// `name`: without the leading dashes.
constexpr bool IsCommonOption(std::string_view name) {
  if (name.find('.') == std::string_view::npos) return name != kDeveloperOption;
  return std::ranges::find(kCommonOptions, name) != kCommonOptions.end();
}

}  // namespace mono3d::tools
