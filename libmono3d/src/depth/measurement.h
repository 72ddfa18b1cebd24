// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>

#include "depth/padded_image.h"

namespace mono3d {

// Zeros around the measurements, px: the radius of the window of surface.comp.
inline constexpr std::uint32_t kMeasurementBorder = 3;

// Including the border; an even number.
inline std::size_t MeasurementsPerRow(LevelSize size) {
  return (std::size_t{size.width_px} + 2 * kMeasurementBorder + 1) / 2 * 2;
}

// Including the border. Each has two words (shaders/depth/measurement.glsl); rows from the top.
inline std::size_t NumMeasurements(LevelSize size) {
  return MeasurementsPerRow(size) * (size.height_px + 2 * kMeasurementBorder);
}

}  // namespace mono3d
