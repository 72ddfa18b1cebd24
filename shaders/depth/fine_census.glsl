// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The layout of the words of fine_census.comp, in rows of 4 * ceil(width / 4): a texel holds those
// of (x, y) to (x + 3, y) for each even x, so that two neighbours in a row are always in one texel.
// One texel before the first takes the writes to the left of the image. Host side:
// depth/fine_volume.h.

int FineCensusTexelsPerRow(uint width_px) { return 2 * int((width_px + 3u) / 4u); }
int FineCensusTexels(uint width_px, uint height_px) {  // of an image
  return FineCensusTexelsPerRow(width_px) * int(height_px) + 1;
}
const int kFirstFineCensusTexel = 1;
