// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Takes over the first image, the reference, and makes of each other a group of four: itself, and the
// images half a pixel to the right, below, and both. A census looked up among the four is at most a
// quarter pixel off in each direction, not a half. One word of four pixels an invocation, padding
// included; image = z.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "depth/half_pixel.params.h"
#include "depth/padded_image.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, r32ui) uniform readonly uimageBuffer images;  // padded images
layout(binding = 1, std430) writeonly buffer Shifted {            // 1 + 4 * (number - 1) padded images
  uint shifted[];
};

// Mean of each byte pair, rounded up: (a | b) - ((a ^ b) >> 1) without borrow between the bytes.
uint MeanOfBytes(uint a, uint b) { return (a | b) - (((a ^ b) & 0xfefefefeu) >> 1); }

// The word and, in y, the word of the right neighbours of its pixels.
uvec2 WordAndRight(int base, int words_per_row, int column, int row) {
  const int index = base + row * words_per_row + column;
  const uint word = imageLoad(images, index).x;
  // The last pixel of the padding is its own neighbour.
  const uint next = column + 1 < words_per_row ? imageLoad(images, index + 1).x : word >> 24;
  return uvec2(word, (word >> 8) | (next << 24));
}

void main() {
  const int words_per_row = int(PaddedWordsPerRow(params.width_px));
  const int rows = int(params.height_px) + 2 * kPadding;
  const int column = int(gl_GlobalInvocationID.x);
  const int row = int(gl_GlobalInvocationID.y);
  if (column >= words_per_row || row >= rows) return;
  const int image_words = words_per_row * rows;
  const int base = int(gl_GlobalInvocationID.z) * image_words;
  const uvec2 here = WordAndRight(base, words_per_row, column, row);
  const uvec2 below = WordAndRight(base, words_per_row, column, min(row + 1, rows - 1));
  const int image = int(gl_GlobalInvocationID.z);
  const int first = image == 0 ? 0 : 4 * image - 3;
  const int index = first * image_words + row * words_per_row + column;
  shifted[index] = here.x;
  if (image == 0) return;
  const uint right = MeanOfBytes(here.x, here.y);
  shifted[index + image_words] = right;
  shifted[index + 2 * image_words] = MeanOfBytes(here.x, below.x);
  shifted[index + 3 * image_words] = MeanOfBytes(right, MeanOfBytes(below.x, below.y));
}
