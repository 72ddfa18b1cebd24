// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Detail of grey images: what is left when the image halved twice, a Gaussian of some 4 px, is
// taken away, times the gain of the image, so that changes of exposure and light do not look like
// motion. Stored as the four pixels that bilinear interpolation needs, in one word. Four words of
// four rows an invocation; image = first_image + z.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require

#include "depth/detail.params.h"
#include "depth/padded_image.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, rgba32ui) uniform readonly uimageBuffer images;   // padded
layout(binding = 1, rgba32ui) uniform readonly uimageBuffer quarter;  // the same, halved twice, padded
layout(binding = 2, r32ui) uniform readonly uimageBuffer gains;  // per image, in 1024ths
// Of (x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1), the lowest byte first: detail + 128. Rows of
// 4 * ceil(width / 4).
layout(binding = 3, std430) writeonly buffer Detail {
  uvec4 detail[];
};

int quarter_base, quarter_words_per_row;

#define WORDS images
#include "depth/three_words.glsl"

// Quarter pixels (x, y) to (x + 2, y).
ivec3 QuarterPixels(int x, int y) {
  const int first = quarter_base + PaddedWordIndex(quarter_words_per_row, x >> 2, y);
  const uvec2 words =
      CutThreeWords(imageLoad(quarter, first >> 2), imageLoad(quarter, (first + 1) >> 2), first).xy;
  const int shift = 8 * (x & 3);
  const uint bytes = (words.x >> shift) | ((words.y << 1) << (31 - shift));
  return ivec3((uvec3(bytes) >> uvec3(0, 8, 16)) & 0xffu);
}

// Eighths of the quarter pixels before, at and after, for the five pixels from 4 n on; in the same
// way of the quarter rows for the five rows from 4 n on.
const int kBefore[5] = int[](3, 1, 0, 0, 0);
const int kHere[5] = int[](5, 7, 7, 5, 3);
const int kAfter[5] = int[](0, 0, 1, 3, 5);

void main() {
  const int groups_per_row = int(params.width_px + 3u) / 4;
  const int height = int(params.height_px);
  const int group = int(gl_GlobalInvocationID.x);
  const int row_group = int(gl_GlobalInvocationID.y);
  const int wanted = int(gl_GlobalInvocationID.z);
  const int image = int(params.first_image) + wanted;
  if (group >= groups_per_row || 4 * row_group >= height) return;
  const uint quarter_width = ((params.width_px + 1u) / 2u + 1u) / 2u;
  const uint quarter_height = ((params.height_px + 1u) / 2u + 1u) / 2u;
  quarter_words_per_row = int(PaddedWordsPerRow(quarter_width));
  quarter_base = image * int(PaddedWords(quarter_width, quarter_height));
  const int words_per_row = groups_per_row + 2;
  const int first = image * int(PaddedWords(params.width_px, params.height_px)) +
                    PaddedWordIndex(words_per_row, group, 4 * row_group);

  const int gain = int(imageLoad(gains, image).x);
  int means[3][5];  // of three quarter rows, in eighths
  [[unroll]] for (int line = 0; line < 3; ++line) {
    const ivec3 pixels = QuarterPixels(group - 1, row_group + line - 1);
    [[unroll]] for (int i = 0; i < 5; ++i) {
      means[line][i] = kBefore[i] * pixels.x + kHere[i] * pixels.y + kAfter[i] * pixels.z;
    }
  }
  uint above[5];
  [[unroll]] for (int dy = 0; dy < 5; ++dy) {
    const uvec3 words = ThreeWords(first + dy * words_per_row);
    const uint word = words.x;
    const uint next = words.y;
    uint bytes[5];
    [[unroll]] for (int i = 0; i < 5; ++i) {
      const int grey = int(i < 4 ? (word >> (8 * i)) & 0xffu : next & 0xffu);
      const int mean = kBefore[dy] * means[0][i] + kHere[dy] * means[1][i] + kAfter[dy] * means[2][i];
      bytes[i] = uint(clamp(((gain * (64 * grey - mean) + 32768) >> 16) + 128, 0, 255));
    }
    if (dy > 0 && 4 * row_group + dy - 1 < height) {
      uvec4 words;
      [[unroll]] for (int i = 0; i < 4; ++i) {
        words[i] = above[i] | (above[i + 1] << 8) | (bytes[i] << 16) | (bytes[i + 1] << 24);
      }
      detail[(wanted * height + 4 * row_group + dy - 1) * groups_per_row + group] = words;
    }
    [[unroll]] for (int i = 0; i < 5; ++i) above[i] = bytes[i];
  }
}
