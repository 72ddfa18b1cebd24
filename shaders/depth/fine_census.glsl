// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The layout of the words of fine_census.comp, in rows of 4 * ceil(width / 4) pixels: two words of
// each, its own and that of its neighbour to the right, so that one texel of two words holds both.
// Two texels before the first take the write to the left of the image. Host side:
// depth/fine_volume.h.

int FineCensusTexelsPerRow(uint width_px) { return 4 * int((width_px + 3u) / 4u); }
int FineCensusTexels(uint width_px, uint height_px) {  // of an image
  return FineCensusTexelsPerRow(width_px) * int(height_px) + 2;
}
const int kFirstFineCensusTexel = 2;
