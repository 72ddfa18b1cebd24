// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>

#include "depth/padded_image.h"

namespace mono3d {

// Planes that each pixel of a finer level is matched on, around its prior
// (shaders/depth/prior.comp).
inline constexpr std::uint32_t kLocalPlanes = 16;
inline constexpr std::uint32_t kNumPaths = 8;
inline constexpr std::uint32_t kFewPaths = 4;  // along rows and columns

// Columns of eight pixels, from top to bottom (shaders/depth/local_volume.glsl).
inline std::size_t NumLocalPixels(LevelSize size) {
  return std::size_t{8} * ((size.width_px + 7) / 8) * size.height_px;
}

}  // namespace mono3d
