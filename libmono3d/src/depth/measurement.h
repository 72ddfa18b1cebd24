// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>

#include "depth/padded_image.h"

namespace mono3d {

// Of zeros around the measurements: the radius of the window of SurfaceStage.
inline constexpr std::uint32_t kMeasurementBorder = 3;

// With the border; an even number.
inline std::size_t MeasurementsPerRow(LevelSize size) {
  return (std::size_t{size.width_px} + 2 * kMeasurementBorder + 1) / 2 * 2;
}

// Of two words (shaders/depth/measurement.glsl), in rows from the top, with the border.
inline std::size_t NumMeasurements(LevelSize size) {
  return MeasurementsPerRow(size) * (size.height_px + 2 * kMeasurementBorder);
}

}  // namespace mono3d
