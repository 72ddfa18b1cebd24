// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Where fine_census.comp puts the words of the pixels, in rows of 4 * ceil(width / 4): a texel holds
// those of (x, y) to (x + 3, y) for each even x, so that two pixels next to each other are always
// in one. A texel in front of the first takes what has no place. Host side: depth/fine_volume.h.

int FineCensusTexelsPerRow(uint width_px) { return 2 * int((width_px + 3u) / 4u); }
int FineCensusTexels(uint width_px, uint height_px) {  // of an image
  return FineCensusTexelsPerRow(width_px) * int(height_px) + 1;
}
const int kFirstFineCensusTexel = 1;
