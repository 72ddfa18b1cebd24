// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Census transform, 9x7 (Zabih and Woodfill 1994): bit n is set where the n-th neighbour, in rows
// from the top left and without the centre, is darker than the centre. 62 bits, in two words.
// Four pixels an invocation, compared as the bytes of a word; image = z.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "depth/census.params.h"
#include "depth/padded_image.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, r32ui) uniform readonly uimageBuffer images;  // padded images
// For each image the words of bits 0..31 of all pixels, then those of bits 32..61; rows of
// 4 * ceil(width / 4) pixels.
layout(binding = 1, std430) writeonly buffer Census {
  uvec4 census[];
};

const uint kHigh = 0x80808080u;

// The high bit of each byte is set where a < b, for unsigned bytes.
uint Less(uint a, uint b) {
  const uint low_not_less = (a | kHigh) - (b & ~kHigh);
  return ((~a & b) | (~(a ^ b) & ~low_not_less)) & kHigh;
}

// Words of the pixels to the left of those of `here` by 1 to 3, and to the right.
#define LEFT(n) ((before >> (32 - 8 * n)) | (here << (8 * n)))
#define RIGHT(n) ((here >> (8 * n)) | (after << (32 - 8 * n)))

uint before, here, after;

void LoadRow(int index) {
  before = imageLoad(images, index - 1).x;
  here = imageLoad(images, index).x;
  after = imageLoad(images, index + 1).x;
}

// Bit n of four pixels to bit n % 8 of their bytes in the word for bits 8 * (n / 8) and on.
#define PUT(bits, n, neighbours) bits |= Less(neighbours, centre) >> (7 - (n) % 8)

void main() {
  const int groups_per_row = int(params.width_px + 3u) / 4;
  const int group = int(gl_GlobalInvocationID.x);
  const int row = int(gl_GlobalInvocationID.y);
  const int image = int(gl_GlobalInvocationID.z);
  if (group >= groups_per_row || row >= int(params.height_px)) return;
  const int stride = groups_per_row + 2;
  const int index = image * int(PaddedWords(params.width_px, params.height_px)) +
                    PaddedWordIndex(stride, group, row);
  const uint centre = imageLoad(images, index).x;
  uint b0 = 0u, b1 = 0u, b2 = 0u, b3 = 0u, b4 = 0u, b5 = 0u, b6 = 0u, b7 = 0u;

  LoadRow(index - 3 * stride);
  PUT(b0, 0, before); PUT(b0, 1, LEFT(3)); PUT(b0, 2, LEFT(2)); PUT(b0, 3, LEFT(1));
  PUT(b0, 4, here);
  PUT(b0, 5, RIGHT(1)); PUT(b0, 6, RIGHT(2)); PUT(b0, 7, RIGHT(3)); PUT(b1, 8, after);

  LoadRow(index - 2 * stride);
  PUT(b1, 9, before); PUT(b1, 10, LEFT(3)); PUT(b1, 11, LEFT(2)); PUT(b1, 12, LEFT(1));
  PUT(b1, 13, here);
  PUT(b1, 14, RIGHT(1)); PUT(b1, 15, RIGHT(2)); PUT(b2, 16, RIGHT(3)); PUT(b2, 17, after);

  LoadRow(index - stride);
  PUT(b2, 18, before); PUT(b2, 19, LEFT(3)); PUT(b2, 20, LEFT(2)); PUT(b2, 21, LEFT(1));
  PUT(b2, 22, here);
  PUT(b2, 23, RIGHT(1)); PUT(b3, 24, RIGHT(2)); PUT(b3, 25, RIGHT(3)); PUT(b3, 26, after);

  LoadRow(index);
  PUT(b3, 27, before); PUT(b3, 28, LEFT(3)); PUT(b3, 29, LEFT(2)); PUT(b3, 30, LEFT(1));
  PUT(b3, 31, RIGHT(1)); PUT(b4, 32, RIGHT(2)); PUT(b4, 33, RIGHT(3)); PUT(b4, 34, after);

  LoadRow(index + stride);
  PUT(b4, 35, before); PUT(b4, 36, LEFT(3)); PUT(b4, 37, LEFT(2)); PUT(b4, 38, LEFT(1));
  PUT(b4, 39, here);
  PUT(b5, 40, RIGHT(1)); PUT(b5, 41, RIGHT(2)); PUT(b5, 42, RIGHT(3)); PUT(b5, 43, after);

  LoadRow(index + 2 * stride);
  PUT(b5, 44, before); PUT(b5, 45, LEFT(3)); PUT(b5, 46, LEFT(2)); PUT(b5, 47, LEFT(1));
  PUT(b6, 48, here);
  PUT(b6, 49, RIGHT(1)); PUT(b6, 50, RIGHT(2)); PUT(b6, 51, RIGHT(3)); PUT(b6, 52, after);

  LoadRow(index + 3 * stride);
  PUT(b6, 53, before); PUT(b6, 54, LEFT(3)); PUT(b6, 55, LEFT(2)); PUT(b7, 56, LEFT(1));
  PUT(b7, 57, here);
  PUT(b7, 58, RIGHT(1)); PUT(b7, 59, RIGHT(2)); PUT(b7, 60, RIGHT(3)); PUT(b7, 61, after);

  // Bytes of bits to words of pixels.
  uvec4 low, high;
#define WORD(a, b, c, d, p) \
  ((((a) >> (8 * p)) & 0xffu) | ((((b) >> (8 * p)) & 0xffu) << 8) | \
   ((((c) >> (8 * p)) & 0xffu) << 16) | ((((d) >> (8 * p)) & 0xffu) << 24))
  low = uvec4(WORD(b0, b1, b2, b3, 0), WORD(b0, b1, b2, b3, 1), WORD(b0, b1, b2, b3, 2),
              WORD(b0, b1, b2, b3, 3));
  high = uvec4(WORD(b4, b5, b6, b7, 0), WORD(b4, b5, b6, b7, 1), WORD(b4, b5, b6, b7, 2),
               WORD(b4, b5, b6, b7, 3));
  const int plane = groups_per_row * int(params.height_px);
  const int out_index = 2 * image * plane + row * groups_per_row + group;
  census[out_index] = low;
  census[out_index + plane] = high;
}
