// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/padded_image.h"

#include <algorithm>

namespace mono3d {

std::vector<std::uint32_t> PackPadded(const cv::Mat& grey) {
  const LevelSize size{static_cast<std::uint32_t>(grey.cols),
                       static_cast<std::uint32_t>(grey.rows)};
  constexpr int kPadding = static_cast<int>(kImagePadding);
  const int num_columns = 4 * static_cast<int>(PaddedWordsPerRow(size));
  const int num_rows = static_cast<int>(PaddedRows(size));
  std::vector<std::uint32_t> words(PaddedWords(size), 0);
  std::size_t next = 0;
  for (int row = 0; row < num_rows; ++row) {
    const std::uint8_t* line = grey.ptr<std::uint8_t>(std::clamp(row - kPadding, 0, grey.rows - 1));
    for (int column = 0; column < num_columns; ++column, ++next) {
      const std::uint32_t pixel = line[std::clamp(column - kPadding, 0, grey.cols - 1)];
      words[next / 4] |= pixel << (8 * (next % 4));
    }
  }
  return words;
}

}  // namespace mono3d
