// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Detail of grey images: what is left when the image halved twice, a Gaussian of some 4 px, is taken
// away, so that changes of exposure and light do not look like motion. Stored as the four pixels
// that bilinear interpolation needs, in one word. Four words an invocation; image = first_image + z.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require

#include "depth/detail.params.h"
#include "depth/padded_image.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, r32ui) uniform readonly uimageBuffer images;   // padded
layout(binding = 1, r32ui) uniform readonly uimageBuffer quarter;  // the same, halved twice, padded
// Of (x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1), the lowest byte first: detail + 128. Rows of
// 4 * ceil(width / 4).
layout(binding = 2, std430) writeonly buffer Detail {
  uvec4 detail[];
};

int quarter_base, quarter_words_per_row;

uint QuarterPixel(int x, int y) {
  const uint word =
      imageLoad(quarter, quarter_base + PaddedWordIndex(quarter_words_per_row, x >> 2, y)).x;
  return (word >> (8 * (x & 3))) & 0xffu;
}

// Eighths of the quarter pixels before, at and after for the five pixels from 4 n on.
const int kBefore[5] = int[](3, 1, 0, 0, 0);
const int kHere[5] = int[](5, 7, 7, 5, 3);
const int kAfter[5] = int[](0, 0, 1, 3, 5);

int RowMean(uint before, uint here, uint after, int i) {
  return kBefore[i] * int(before) + kHere[i] * int(here) + kAfter[i] * int(after);
}

void main() {
  const int groups_per_row = int(params.width_px + 3u) / 4;
  const int group = int(gl_GlobalInvocationID.x);
  const int row = int(gl_GlobalInvocationID.y);
  const int wanted = int(gl_GlobalInvocationID.z);
  const int image = int(params.first_image) + wanted;
  if (group >= groups_per_row || row >= int(params.height_px)) return;
  const uint quarter_width = ((params.width_px + 1u) / 2u + 1u) / 2u;
  const uint quarter_height = ((params.height_px + 1u) / 2u + 1u) / 2u;
  quarter_words_per_row = int(PaddedWordsPerRow(quarter_width));
  quarter_base = image * int(PaddedWords(quarter_width, quarter_height));
  const int words_per_row = groups_per_row + 2;
  const int base = image * int(PaddedWords(params.width_px, params.height_px));

  uint bytes[10];
  [[unroll]] for (int dy = 0; dy < 2; ++dy) {
    const int y = row + dy;
    // Weights of the rows above, at and below, as above.
    const int phase = y & 3;
    const int above = phase == 0 ? 3 : phase == 1 ? 1 : 0;
    const int below = phase == 3 ? 3 : phase == 2 ? 1 : 0;
    uint before[3], here[3], after[3];
    [[unroll]] for (int i = 0; i < 3; ++i) {
      const int line = (y >> 2) + i - 1;
      before[i] = QuarterPixel(group - 1, line);
      here[i] = QuarterPixel(group, line);
      after[i] = QuarterPixel(group + 1, line);
    }
    const int index = base + PaddedWordIndex(words_per_row, group, y);
    const uint word = imageLoad(images, index).x;
    const uint next = imageLoad(images, index + 1).x;
    [[unroll]] for (int i = 0; i < 5; ++i) {
      const int grey = int(i < 4 ? (word >> (8 * i)) & 0xffu : next & 0xffu);
      const int mean = above * RowMean(before[0], here[0], after[0], i) +
                       (8 - above - below) * RowMean(before[1], here[1], after[1], i) +
                       below * RowMean(before[2], here[2], after[2], i);
      bytes[5 * dy + i] = uint(clamp(((64 * grey - mean + 32) >> 6) + 128, 0, 255));
    }
  }
  uvec4 words;
  [[unroll]] for (int i = 0; i < 4; ++i) {
    words[i] = bytes[i] | (bytes[i + 1] << 8) | (bytes[i + 5] << 16) | (bytes[i + 6] << 24);
  }
  detail[(wanted * int(params.height_px) + row) * groups_per_row + group] = words;
}
