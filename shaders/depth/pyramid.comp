// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Halves grey images: a binomial approximation of a Gaussian, (1 3 3 1) / 8 each way, centred between
// the middle two pixels as halving demands (c' = (c + 0.5) / 2 - 0.5). One word of four pixels an
// invocation, padding included; image = z.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "depth/padded_image.glsl"
#include "depth/pyramid.params.h"

layout(local_size_x = 64) in;

layout(binding = 0, r32ui) uniform readonly uimageBuffer fine;  // num_images padded images
layout(binding = 1, std430) writeonly buffer Coarse {  // the same images, half the size, rounded up
  uint coarse[];
};

int fine_base;
int fine_words_per_row;

uint FinePixel(int x, int y) {
  const uint word =
      imageLoad(fine, fine_base + PaddedWordIndex(fine_words_per_row, x >> 2, y)).x;
  return (word >> (8 * (x & 3))) & 0xffu;
}

uint RowSum(int x, int y) {
  return FinePixel(x - 1, y) + 3u * (FinePixel(x, y) + FinePixel(x + 1, y)) + FinePixel(x + 2, y);
}

uint CoarsePixel(int x, int y) {
  const uint sum = RowSum(2 * x, 2 * y - 1) +
                   3u * (RowSum(2 * x, 2 * y) + RowSum(2 * x, 2 * y + 1)) +
                   RowSum(2 * x, 2 * y + 2);
  return (sum + 32u) >> 6;
}

void main() {
  const int width = int(params.fine_width_px + 1u) / 2;
  const int height = int(params.fine_height_px + 1u) / 2;
  const int words_per_row = int(PaddedWordsPerRow(uint(width)));
  const int column = int(gl_GlobalInvocationID.x);
  const int row = int(gl_GlobalInvocationID.y);
  if (column >= words_per_row || row >= height + 2 * kPadding) return;
  fine_words_per_row = int(PaddedWordsPerRow(params.fine_width_px));
  fine_base =
      int(gl_GlobalInvocationID.z * PaddedWords(params.fine_width_px, params.fine_height_px));
  const int y = clamp(row - kPadding, 0, height - 1);
  const int x = 4 * column - kPadding;
  const uint word = CoarsePixel(clamp(x, 0, width - 1), y) |
                    (CoarsePixel(clamp(x + 1, 0, width - 1), y) << 8) |
                    (CoarsePixel(clamp(x + 2, 0, width - 1), y) << 16) |
                    (CoarsePixel(clamp(x + 3, 0, width - 1), y) << 24);
  const uint base = gl_GlobalInvocationID.z * PaddedWords(uint(width), uint(height));
  coarse[base + uint(row * words_per_row + column)] = word;
}
