// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// A grey image of bytes, four pixels a word, the lowest byte first, with kPadding replicated pixels
// on each side, so that stencils of radius 4 need no clamping. Host side: depth/padded_image.h.
const int kPadding = 4;

uint PaddedWordsPerRow(uint width_px) { return (width_px + 3u) / 4u + 2u; }
uint PaddedWords(uint width_px, uint height_px) {
  return PaddedWordsPerRow(width_px) * (height_px + 8u);
}
// Word of the pixels 4 * group .. 4 * group + 3 of a row; group and row may reach into the padding.
int PaddedWordIndex(int words_per_row, int group, int row) {
  return (row + kPadding) * words_per_row + group + 1;
}
