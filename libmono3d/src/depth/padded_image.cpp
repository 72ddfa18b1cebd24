// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/padded_image.h"

#include <algorithm>
#include <bit>

namespace mono3d {

static_assert(std::endian::native == std::endian::little);

std::vector<std::uint32_t> PackPadded(const cv::Mat& grey) {
  const LevelSize size{static_cast<std::uint32_t>(grey.cols),
                       static_cast<std::uint32_t>(grey.rows)};
  const std::size_t bytes_per_row = 4 * std::size_t{PaddedWordsPerRow(size)};
  const auto num_columns = static_cast<std::size_t>(grey.cols);
  const auto num_rows = static_cast<int>(PaddedRows(size));
  std::vector<std::uint32_t> words(PaddedWords(size));
  auto* to = reinterpret_cast<std::uint8_t*>(words.data());  // the lowest byte of a word first
  for (int row = 0; row < num_rows; ++row, to += bytes_per_row) {
    const auto* line =
        grey.ptr<std::uint8_t>(std::clamp(row - static_cast<int>(kImagePadding), 0, grey.rows - 1));
    std::fill_n(to, kImagePadding, line[0]);
    std::copy_n(line, num_columns, to + kImagePadding);
    std::fill(to + kImagePadding + num_columns, to + bytes_per_row, line[num_columns - 1]);
  }
  return words;
}

}  // namespace mono3d
