// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Halves grey images: a binomial approximation of a Gaussian, (1 3 3 1) / 8 each way, centred
// between the middle two pixels as halving demands (c' = (c + 0.5) / 2 - 0.5). One word of four
// pixels an invocation, padding included; image = z.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require

#include "depth/padded_image.glsl"
#include "depth/pyramid.params.h"

layout(local_size_x = 64) in;

layout(binding = 0, rgba32ui) uniform readonly uimageBuffer fine;  // num_images padded images
layout(binding = 1, std430) writeonly buffer Coarse {  // the same images, half the size, rounded up
  uint coarse[];
};

#define WORDS fine
#include "depth/three_words.glsl"

// Row sums of four coarse pixels: columns 8 group - 1 to 8 group + 8 of a row.
uvec4 RowSums(int index) {
  const uvec4 words = FourWords(index - 1);
  const uint before = words.x;
  const uint first = words.y;
  const uint second = words.z;
  const uint after = words.w;
  const uvec4 low = (uvec4(first) >> uvec4(0, 8, 16, 24)) & 0xffu;
  const uvec4 high = (uvec4(second) >> uvec4(0, 8, 16, 24)) & 0xffu;
  return uvec4(before >> 24, low.y, low.w, high.y) + 3u * uvec4(low.xz, high.xz) +
         3u * uvec4(low.yw, high.yw) + uvec4(low.z, high.xz, after & 0xffu);
}

void main() {
  const int width = int(params.fine_width_px + 1u) / 2;
  const int height = int(params.fine_height_px + 1u) / 2;
  const int words_per_row = int(PaddedWordsPerRow(uint(width)));
  const int column = int(gl_GlobalInvocationID.x);
  const int row = int(gl_GlobalInvocationID.y);
  if (column >= words_per_row || row >= height + 2 * kPadding) return;
  const int fine_words_per_row = int(PaddedWordsPerRow(params.fine_width_px));
  const int fine_base =
      int(gl_GlobalInvocationID.z * PaddedWords(params.fine_width_px, params.fine_height_px));
  // The padding takes its pixels from the nearest group of the image.
  const int y = clamp(row - kPadding, 0, height - 1);
  const int group = clamp(column - 1, 0, (width - 1) / 4);
  const int index = fine_base + PaddedWordIndex(fine_words_per_row, 2 * group, 2 * y);
  const uvec4 sums = RowSums(index - fine_words_per_row) +
                     3u * (RowSums(index) + RowSums(index + fine_words_per_row)) +
                     RowSums(index + 2 * fine_words_per_row);
  const uvec4 pixels = (sums + 32u) >> 6;
  const uint word = pixels.x | (pixels.y << 8) | (pixels.z << 16) | (pixels.w << 24);
  uint padded = 0u;
  [[unroll]] for (int i = 0; i < 4; ++i) {
    const int x = clamp(4 * column - kPadding + i, 0, width - 1) - 4 * group;
    padded |= ((word >> (8 * x)) & 0xffu) << (8 * i);
  }
  const uint base = gl_GlobalInvocationID.z * PaddedWords(uint(width), uint(height));
  coarse[base + uint(row * words_per_row + column)] = padded;
}
