// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>

#include "depth/padded_image.h"

namespace mono3d {

// Planes that each pixel of a level below the coarsest is matched on, around its prior
// (shaders/depth/prior.comp).
inline constexpr std::uint32_t kFinePlanes = 16;

// Places for pixels in the volumes of these planes: columns of eight pixels, from top to bottom
// (shaders/depth/fine_volume.glsl).
inline std::size_t NumFinePixels(LevelSize size) {
  return std::size_t{8} * ((size.width_px + 7) / 8) * size.height_px;
}

inline std::size_t FinePixelAt(std::size_t x, std::size_t y, std::size_t height_px) {
  return (x / 8 * height_px + y) * 8 + x % 8;
}

// Texels of two words of the census of an image (shaders/depth/fine_census.glsl).
inline std::size_t NumFineCensusTexels(LevelSize size) { return size.num_strided_pixels() + 2; }

}  // namespace mono3d
