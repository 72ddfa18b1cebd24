// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Census transform of every second pixel of a 9x7 window, in the pattern of a chessboard: bit n is
// set where the n-th of these 32 neighbours, in rows from the top left, is darker than the centre.
// With a prior for the depth this is nearly as selective as all 62 neighbours, and one word.
// In a picture that is turned against the reference's the window is turned as well (census.glsl).
// Four pixels of two rows an invocation, compared as the bytes of a word; image = z.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require

#include "depth/fine_census.params.h"
#include "depth/padded_image.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, rgba32ui) uniform readonly uimageBuffer images;  // padded images, in words
layout(binding = 1, std430) writeonly buffer Census {  // pairs of texels, fine_census.glsl
  uvec4 census[];
};

#define WORDS images
#include "depth/three_words.glsl"
#include "depth/census.glsl"
#include "depth/fine_census.glsl"

// A word each of the four pixels in the middle of seven rows of three words.
uvec4 Upright(uvec3 r0, uvec3 r1, uvec3 r2, uvec3 r3, uvec3 r4, uvec3 r5, uvec3 r6) {
  const uint centre = r3.y;
  uint before, here, after;
  uint b0 = 0u, b1 = 0u, b2 = 0u, b3 = 0u;
  UNPACK(r0);
  PUT(b0, before); PUT(b0, LEFT(2)); PUT(b0, here); PUT(b0, RIGHT(2)); PUT(b0, after);
  UNPACK(r1);
  PUT(b0, LEFT(3)); PUT(b0, LEFT(1)); PUT(b0, RIGHT(1)); PUT(b1, RIGHT(3));
  UNPACK(r2);
  PUT(b1, before); PUT(b1, LEFT(2)); PUT(b1, here); PUT(b1, RIGHT(2)); PUT(b1, after);
  UNPACK(r3);
  PUT(b1, LEFT(3)); PUT(b1, LEFT(1)); PUT(b2, RIGHT(1)); PUT(b2, RIGHT(3));
  UNPACK(r4);
  PUT(b2, before); PUT(b2, LEFT(2)); PUT(b2, here); PUT(b2, RIGHT(2)); PUT(b2, after);
  UNPACK(r5);
  PUT(b2, LEFT(3)); PUT(b3, LEFT(1)); PUT(b3, RIGHT(1)); PUT(b3, RIGHT(3));
  UNPACK(r6);
  PUT(b3, before); PUT(b3, LEFT(2)); PUT(b3, here); PUT(b3, RIGHT(2)); PUT(b3, after);
  return uvec4(WORD(b0, b1, b2, b3, 0), WORD(b0, b1, b2, b3, 1), WORD(b0, b1, b2, b3, 2),
               WORD(b0, b1, b2, b3, 3));
}

// Of a picture that is turned by one quarter; `middle` is the word of the four pixels.
uvec4 Turned(int middle, int words_per_row) {
  const uint centre = ThreeWords(middle - 1).y;
  uint b[4] = uint[4](0u, 0u, 0u, 0u);
  int n = 0;
  for (int y = -3; y <= 3; ++y) {
    for (int x = (y & 1) == 0 ? -3 : -4; x <= 4; x += 2) {
      PUT(b[n >> 3], TurnedNeighbours(middle, words_per_row, x, y));
      ++n;
    }
  }
  return uvec4(WORD(b[0], b[1], b[2], b[3], 0), WORD(b[0], b[1], b[2], b[3], 1),
               WORD(b[0], b[1], b[2], b[3], 2), WORD(b[0], b[1], b[2], b[3], 3));
}

// `pair` is that of the first two pixels' texels. Two quarters more of a turn: bit n becomes bit
// 31 - n, the neighbour on the other side of the centre.
void Store(uvec4 words, uint quarter_turns, int pair) {
  if (quarter_turns >= 2u) words = bitfieldReverse(words);
  census[pair - 1].w = words.x;
  census[pair] = words.xyyz;
  census[pair + 1].xyz = words.zww;
}

void main() {
  const int groups_per_row = int(params.width_px + 3u) / 4;
  const int height = int(params.height_px);
  const int group = int(gl_GlobalInvocationID.x);
  const int row = 2 * int(gl_GlobalInvocationID.y);
  const int image = int(gl_GlobalInvocationID.z);
  if (group >= groups_per_row || row >= height) return;
  const int words_per_row = groups_per_row + 2;
  const uint quarter_turns = QuarterTurns(image);
  const int stride = FineCensusTexelsPerRow(params.width_px);
  const int pair = (image * FineCensusTexels(params.width_px, params.height_px) +
                    kFirstFineCensusTexel + row * stride) / 2 + 2 * group;
  const int middle = image * int(PaddedWords(params.width_px, params.height_px)) +
                     PaddedWordIndex(words_per_row, group, row);
  if ((quarter_turns & 1u) != 0u) {
    Store(Turned(middle, words_per_row), quarter_turns, pair);
    if (row + 1 < height) {
      Store(Turned(middle + words_per_row, words_per_row), quarter_turns, pair + stride / 2);
    }
    return;
  }
  const int first = middle - 3 * words_per_row - 1;
  const uvec3 r0 = ThreeWords(first);
  const uvec3 r1 = ThreeWords(first + words_per_row);
  const uvec3 r2 = ThreeWords(first + 2 * words_per_row);
  const uvec3 r3 = ThreeWords(first + 3 * words_per_row);
  const uvec3 r4 = ThreeWords(first + 4 * words_per_row);
  const uvec3 r5 = ThreeWords(first + 5 * words_per_row);
  const uvec3 r6 = ThreeWords(first + 6 * words_per_row);
  Store(Upright(r0, r1, r2, r3, r4, r5, r6), quarter_turns, pair);
  if (row + 1 < height) {
    const uvec3 r7 = ThreeWords(first + 7 * words_per_row);
    Store(Upright(r1, r2, r3, r4, r5, r6, r7), quarter_turns, pair + stride / 2);
  }
}
