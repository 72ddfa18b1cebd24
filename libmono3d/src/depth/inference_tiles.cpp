// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/inference_tiles.h"

#include <opencv2/core.hpp>

#include "gpu/recorder.h"

namespace mono3d {
namespace {

constexpr std::uint32_t kNoTile = 0x00ffffffU;  // its rows still count in 31 bits

std::uint32_t TilesPerRow(cv::Size map) {
  return DivideRoundingUp(static_cast<std::uint64_t>(map.width), kInferenceTileWidth);
}

}  // namespace

std::vector<std::uint32_t> TilesWithoutDepth(const cv::Mat& depth) {
  const std::uint32_t num_tiles =
      TilesPerRow(depth.size()) *
      DivideRoundingUp(static_cast<std::uint64_t>(depth.rows), kInferenceTileHeight);
  std::vector<std::uint32_t> tiles;
  for (std::uint32_t tile = 0; tile < num_tiles; ++tile) {
    const cv::Mat part = depth(PixelsOfTile(tile, depth.size()));
    if (cv::countNonZero(part) < static_cast<int>(part.total())) tiles.push_back(tile);
  }
  return tiles;
}

cv::Rect PixelsOfTile(std::uint32_t tile, cv::Size map) {
  const auto column = static_cast<int>(tile % TilesPerRow(map));
  const auto row = static_cast<int>(tile / TilesPerRow(map));
  return cv::Rect(kInferenceTileWidth * column, kInferenceTileHeight * row, kInferenceTileWidth,
                  kInferenceTileHeight) &
         cv::Rect(cv::Point(), map);
}

std::array<std::uint32_t, 2> GridOfTiles(std::size_t num_tiles) {
  const auto columns =
      static_cast<std::uint32_t>(std::min<std::size_t>(num_tiles, kMaxTilesInARow));
  return {columns, columns == 0 ? 0 : DivideRoundingUp(num_tiles, columns)};
}

std::vector<std::uint32_t> WordsOfTiles(std::span<const std::uint32_t> tiles) {
  const auto [columns, rows] = GridOfTiles(tiles.size());
  std::vector<std::uint32_t> words(tiles.begin(), tiles.end());
  words.resize(std::size_t{columns} * rows, kNoTile);
  return words;
}

}  // namespace mono3d
