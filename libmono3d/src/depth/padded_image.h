// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace mono3d {

// Size of the images of one pyramid level.
struct LevelSize {
  std::uint32_t width_px = 0;
  std::uint32_t height_px = 0;

  std::uint32_t groups_per_row() const { return (width_px + 3) / 4; }  // of four pixels
  std::size_t num_pixels() const { return std::size_t{width_px} * height_px; }
  // Rows of whole groups, as census and DoG store them.
  std::size_t num_strided_pixels() const { return std::size_t{4} * groups_per_row() * height_px; }
  LevelSize Halved() const { return {(width_px + 1) / 2, (height_px + 1) / 2}; }
  bool operator==(const LevelSize&) const = default;
};

// A grey image as shaders/depth/padded_image.glsl reads it: bytes, rows of whole words, with
// kImagePadding replicated pixels on each side (and the rest of the last word of a row).
inline constexpr std::uint32_t kImagePadding = 4;

inline std::uint32_t PaddedWordsPerRow(LevelSize size) { return size.groups_per_row() + 2; }
inline std::uint32_t PaddedRows(LevelSize size) { return size.height_px + 2 * kImagePadding; }
inline std::size_t PaddedWords(LevelSize size) {
  return std::size_t{PaddedWordsPerRow(size)} * PaddedRows(size);
}

// `grey` is CV_8UC1.
std::vector<std::uint32_t> PackPadded(const cv::Mat& grey);

}  // namespace mono3d
