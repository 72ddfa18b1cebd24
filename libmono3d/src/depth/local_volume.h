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

// Pixels from row to row of the local volumes. Paths along the rows walk through several rows at
// once: the distance of the rows in bytes is kept off powers of two, which would all lie in the
// same lines of a cache.
inline std::uint32_t LocalStride(LevelSize size) {
  const std::uint32_t stride = 4 * size.groups_per_row();
  return stride % 64 == 0 ? stride + 4 : stride;
}

inline std::size_t NumLocalPixels(LevelSize size) {
  return std::size_t{LocalStride(size)} * size.height_px;
}

}  // namespace mono3d
