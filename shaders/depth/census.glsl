// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// What the census transforms share: comparisons of four pixels at once, as the bytes of a word,
// with neighbours in a row of three words; and windows that are turned as the picture is, so that
// their bits stand for the same places of the surface. The including shader has three_words.glsl
// and params.quarter_turns: two bits an image, the first image's lowest. An image is turned by k
// quarters where a step to the right in the reference is one that is turned by k quarters
// clockwise in it. Host side: PackQuarterTurns of depth/sweep_geometry.h.

const uint kHigh = 0x80808080u;

// The high bit of each byte is set where a < b, for unsigned bytes; the others mean nothing.
uint Less(uint a, uint b) {
  const uint low_not_less = (a | kHigh) - (b & ~kHigh);
  return (~a & b) | (~(a ^ b) & ~low_not_less);
}

// Words of the pixels to the left of those of `here` by 1 to 3, and to the right.
#define LEFT(n) ((before >> (32 - 8 * n)) | (here << (8 * n)))
#define RIGHT(n) ((here >> (8 * n)) | (after << (32 - 8 * n)))
#define UNPACK(row) before = row.x; here = row.y; after = row.z

// One more bit of each of the four pixels, on top of those before.
#define PUT(bits, neighbours) bits = (bits >> 1) | (Less(neighbours, centre) & kHigh)

// Byte p of a, b, c and d.
#define WORD(a, b, c, d, p) \
  ((((a) >> (8 * p)) & 0xffu) | ((((b) >> (8 * p)) & 0xffu) << 8) | \
   ((((c) >> (8 * p)) & 0xffu) << 16) | ((((d) >> (8 * p)) & 0xffu) << 24))

uint QuarterTurns(int image) { return (params.quarter_turns >> (2 * image)) & 3u; }

// Of the four pixels in word `middle`, the neighbours where a picture that is turned by one quarter
// shows what the reference shows at (x, y) from the centre: at (-y, x).
uint TurnedNeighbours(int middle, int words_per_row, int x, int y) {
  const uvec3 row = ThreeWords(middle + x * words_per_row - 1);
  uint before, here, after;
  UNPACK(row);
  if (y == 0) return here;
  return y > 0 ? LEFT(y) : RIGHT(-y);
}
