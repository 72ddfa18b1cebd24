// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "depth/fine_volume.h"
#include "depth/stage_testing.h"
#include "reference/depth/fine_sgm_reference.h"
#include "reference/depth/fine_sweep_reference.h"

namespace mono3d {

// Place of pixel (x, y) in the volumes of fine_volume.h.
inline std::size_t FineIndex(LevelSize size, std::size_t pixel) {
  const std::size_t x = pixel % size.width_px;
  const std::size_t y = pixel / size.width_px;
  return (x / 8 * size.height_px + y) * 8 + x % 8;
}

// Rows of pixels to the order of the kernels.
Buffer FineToBuffer(const reference::FineVolume& volume, LevelSize size);
Buffer FineToBuffer(const std::vector<reference::FineRange>& ranges, LevelSize size);

// The census of images, in the texels of shaders/depth/fine_census.glsl.
Buffer FineToBuffer(const reference::FineCensus& census, LevelSize size);

// And back.
reference::FineCensus FineCensusOf(const Buffer& buffer, LevelSize size, std::size_t num_images);
reference::FineVolume FineVolumeOf(const Buffer& buffer, LevelSize size, std::size_t volume);
std::vector<reference::FineRange> FineRangesOf(const Buffer& buffer, LevelSize size);

reference::FineVolume RandomFineVolume(LevelSize size, std::uint8_t largest, std::mt19937& random);
// First planes that differ by up to more than the 16 planes, all jumps and all grey values.
std::vector<reference::FineRange> RandomFineRanges(LevelSize size, std::mt19937& random);

}  // namespace mono3d
