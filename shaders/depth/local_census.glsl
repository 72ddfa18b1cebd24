// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Where local_census.comp puts the words of the pixels, in rows of 4 * ceil(width / 4): a texel holds
// those of (x, y) to (x + 3, y) for each even x, so that two pixels next to each other are always
// in one. A texel in front of the first takes what has no place. Host side: depth/local_census.h.

int LocalCensusTexelsPerRow(uint width_px) { return 2 * int((width_px + 3u) / 4u); }
int LocalCensusTexels(uint width_px, uint height_px) {  // of an image
  return LocalCensusTexelsPerRow(width_px) * int(height_px) + 1;
}
const int kFirstLocalCensusTexel = 1;
