// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Volumes of 16 planes around each pixel's prior. SGM reads them along eight paths side by side, so
// the pixels are stored in columns of eight, each column from top to bottom: paths in either
// direction read memory in order. Host side: depth/fine_volume.h.
const int kFinePlanes = 16;
const uint kNarrow = 0x01000000u;  // flag of a range (prior.comp): only planes 4 to 11 are matched

int FinePixel(int x, int y, int height) { return (((x >> 3) * height + y) << 3) + (x & 7); }
