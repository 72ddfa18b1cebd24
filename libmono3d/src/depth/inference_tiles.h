// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <span>
#include <vector>

#include "depth/padded_image.h"

namespace mono3d {

// Host side of shaders/depth/inference_tiles.glsl.
inline constexpr int kInferenceTileWidth = 32;
inline constexpr int kInferenceTileHeight = 8;
// Of a row of workgroups; devices take at least 65535.
inline constexpr std::uint32_t kMaxTilesInARow = 32768;

// Numbers of the tiles of a CV_32FC1 map of depth in which a pixel has none.
std::vector<std::uint32_t> TilesWithoutDepth(const cv::Mat& depth);

// Pixels of a tile within a map of this size.
cv::Rect PixelsOfTile(std::uint32_t tile, cv::Size map);

// Workgroups along x and y, at least as many as tiles.
std::array<std::uint32_t, 2> GridOfTiles(std::size_t num_tiles);

// As the shaders read them: a word for each workgroup of GridOfTiles.
std::vector<std::uint32_t> WordsOfTiles(std::span<const std::uint32_t> tiles);

}  // namespace mono3d
