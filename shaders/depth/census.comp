// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Census transform, 9x7 (Zabih and Woodfill 1994): bit n is set where the n-th neighbour, in rows
// from the top left and without the centre, is darker than the centre. 62 bits, in two words.
// In a picture that is turned against the reference's the window is turned as well (census.glsl).
// Four pixels of two rows an invocation, compared as the bytes of a word; image = z.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "depth/census.params.h"
#include "depth/padded_image.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, rgba32ui) uniform readonly uimageBuffer images;  // padded images, in words
// Two words of each pixel, bits 0..31 and bits 32..61; rows of 4 * ceil(width / 4) pixels.
layout(binding = 1, std430) writeonly buffer Census {
  uvec4 census[];
};

#define WORDS images
#include "depth/three_words.glsl"
#include "depth/census.glsl"

// The words of four pixels, in two texels.
struct Words {
  uvec4 first, second;
};

// Of the four pixels in the middle of seven rows of three words.
Words Upright(uvec3 r0, uvec3 r1, uvec3 r2, uvec3 r3, uvec3 r4, uvec3 r5, uvec3 r6) {
  const uint centre = r3.y;
  uint before, here, after;
  uint b0 = 0u, b1 = 0u, b2 = 0u, b3 = 0u, b4 = 0u, b5 = 0u, b6 = 0u, b7 = 0u;
  UNPACK(r0);
  PUT(b0, before); PUT(b0, LEFT(3)); PUT(b0, LEFT(2)); PUT(b0, LEFT(1));
  PUT(b0, here);
  PUT(b0, RIGHT(1)); PUT(b0, RIGHT(2)); PUT(b0, RIGHT(3)); PUT(b1, after);
  UNPACK(r1);
  PUT(b1, before); PUT(b1, LEFT(3)); PUT(b1, LEFT(2)); PUT(b1, LEFT(1));
  PUT(b1, here);
  PUT(b1, RIGHT(1)); PUT(b1, RIGHT(2)); PUT(b2, RIGHT(3)); PUT(b2, after);
  UNPACK(r2);
  PUT(b2, before); PUT(b2, LEFT(3)); PUT(b2, LEFT(2)); PUT(b2, LEFT(1));
  PUT(b2, here);
  PUT(b2, RIGHT(1)); PUT(b3, RIGHT(2)); PUT(b3, RIGHT(3)); PUT(b3, after);
  UNPACK(r3);
  PUT(b3, before); PUT(b3, LEFT(3)); PUT(b3, LEFT(2)); PUT(b3, LEFT(1));
  PUT(b3, RIGHT(1)); PUT(b4, RIGHT(2)); PUT(b4, RIGHT(3)); PUT(b4, after);
  UNPACK(r4);
  PUT(b4, before); PUT(b4, LEFT(3)); PUT(b4, LEFT(2)); PUT(b4, LEFT(1));
  PUT(b4, here);
  PUT(b5, RIGHT(1)); PUT(b5, RIGHT(2)); PUT(b5, RIGHT(3)); PUT(b5, after);
  UNPACK(r5);
  PUT(b5, before); PUT(b5, LEFT(3)); PUT(b5, LEFT(2)); PUT(b5, LEFT(1));
  PUT(b6, here);
  PUT(b6, RIGHT(1)); PUT(b6, RIGHT(2)); PUT(b6, RIGHT(3)); PUT(b6, after);
  UNPACK(r6);
  PUT(b6, before); PUT(b6, LEFT(3)); PUT(b6, LEFT(2)); PUT(b7, LEFT(1));
  PUT(b7, here);
  PUT(b7, RIGHT(1)); PUT(b7, RIGHT(2)); PUT(b7, RIGHT(3)); PUT(b7, after);
  b7 >>= 2;  // six bits only
  return Words(uvec4(WORD(b0, b1, b2, b3, 0), WORD(b4, b5, b6, b7, 0), WORD(b0, b1, b2, b3, 1),
                     WORD(b4, b5, b6, b7, 1)),
               uvec4(WORD(b0, b1, b2, b3, 2), WORD(b4, b5, b6, b7, 2), WORD(b0, b1, b2, b3, 3),
                     WORD(b4, b5, b6, b7, 3)));
}

// Of a picture that is turned by one quarter; `middle` is the word of the four pixels.
Words Turned(int middle, int words_per_row) {
  const uint centre = ThreeWords(middle - 1).y;
  uint b[8] = uint[8](0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u);
  int n = 0;
  for (int y = -3; y <= 3; ++y) {
    for (int x = -4; x <= 4; ++x) {
      if (x == 0 && y == 0) continue;
      PUT(b[n >> 3], TurnedNeighbours(middle, words_per_row, x, y));
      ++n;
    }
  }
  b[7] >>= 2;
  return Words(uvec4(WORD(b[0], b[1], b[2], b[3], 0), WORD(b[4], b[5], b[6], b[7], 0),
                     WORD(b[0], b[1], b[2], b[3], 1), WORD(b[4], b[5], b[6], b[7], 1)),
               uvec4(WORD(b[0], b[1], b[2], b[3], 2), WORD(b[4], b[5], b[6], b[7], 2),
                     WORD(b[0], b[1], b[2], b[3], 3), WORD(b[4], b[5], b[6], b[7], 3)));
}

// Two quarters more: bit n becomes bit 61 - n, the neighbour on the other side of the centre.
uvec2 HalfTurned(uvec2 words) {
  const uvec2 reversed = bitfieldReverse(words.yx);
  return uvec2((reversed.x >> 2) | (reversed.y << 30), reversed.y >> 2);
}

void Store(Words words, uint quarter_turns, int texel) {
  if (quarter_turns >= 2u) {
    words.first = uvec4(HalfTurned(words.first.xy), HalfTurned(words.first.zw));
    words.second = uvec4(HalfTurned(words.second.xy), HalfTurned(words.second.zw));
  }
  census[texel] = words.first;
  census[texel + 1] = words.second;
}

void main() {
  const int groups_per_row = int(params.width_px + 3u) / 4;
  const int height = int(params.height_px);
  const int group = int(gl_GlobalInvocationID.x);
  const int row = 2 * int(gl_GlobalInvocationID.y);
  const int image = int(gl_GlobalInvocationID.z);
  if (group >= groups_per_row || row >= height) return;
  const int stride = groups_per_row + 2;
  const uint quarter_turns = QuarterTurns(image);
  const int texel = 2 * ((image * height + row) * groups_per_row + group);
  const int middle = image * int(PaddedWords(params.width_px, params.height_px)) +
                     PaddedWordIndex(stride, group, row);
  if ((quarter_turns & 1u) != 0u) {
    Store(Turned(middle, stride), quarter_turns, texel);
    if (row + 1 < height) {
      Store(Turned(middle + stride, stride), quarter_turns, texel + 2 * groups_per_row);
    }
    return;
  }
  const int first = middle - 3 * stride - 1;
  const uvec3 r0 = ThreeWords(first);
  const uvec3 r1 = ThreeWords(first + stride);
  const uvec3 r2 = ThreeWords(first + 2 * stride);
  const uvec3 r3 = ThreeWords(first + 3 * stride);
  const uvec3 r4 = ThreeWords(first + 4 * stride);
  const uvec3 r5 = ThreeWords(first + 5 * stride);
  const uvec3 r6 = ThreeWords(first + 6 * stride);
  Store(Upright(r0, r1, r2, r3, r4, r5, r6), quarter_turns, texel);
  if (row + 1 < height) {
    const uvec3 r7 = ThreeWords(first + 7 * stride);
    Store(Upright(r1, r2, r3, r4, r5, r6, r7), quarter_turns, texel + 2 * groups_per_row);
  }
}
