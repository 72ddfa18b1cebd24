// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "depth/local_volume.h"
#include "depth/stage_testing.h"
#include "reference/depth/local_sgm_reference.h"
#include "reference/depth/local_sweep_reference.h"

namespace mono3d {

// Place of pixel (x, y) in the local volumes, as depth/local_volume.h says.
inline std::size_t LocalIndex(LevelSize size, std::size_t pixel) {
  const std::size_t x = pixel % size.width_px;
  const std::size_t y = pixel / size.width_px;
  return (x / 8 * size.height_px + y) * 8 + x % 8;
}

// Rows of pixels to the order of the kernels.
Buffer LocalToBuffer(const reference::LocalVolume& volume, LevelSize size);
Buffer LocalToBuffer(const std::vector<reference::LocalRange>& ranges, LevelSize size);

// The census of images, in the texels of depth/local_census.h.
Buffer LocalToBuffer(const reference::LocalCensus& census, LevelSize size);

// And back.
reference::LocalCensus LocalCensusOf(const Buffer& buffer, LevelSize size, std::size_t num_images);
reference::LocalVolume LocalVolumeOf(const Buffer& buffer, LevelSize size, std::size_t volume);
std::vector<reference::LocalRange> LocalRangesOf(const Buffer& buffer, LevelSize size);

reference::LocalVolume RandomLocalVolume(LevelSize size, std::uint8_t largest,
                                         std::mt19937& random);
// First planes that differ by up to more than the 16 planes, all jumps and all grey values.
std::vector<reference::LocalRange> RandomLocalRanges(LevelSize size, std::mt19937& random);

}  // namespace mono3d
