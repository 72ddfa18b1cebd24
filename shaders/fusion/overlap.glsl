// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// What the stages share that merge parts of the model after a correction.
#include "fusion/surfel.glsl"
#include "fusion/view.glsl"

const uint kNoSurfel = 0xFFFFFFFFu;

// Fixed point of the sums of shares, so that they do not depend on the order of addition.
const float kShareSteps = 1024.0;
const float kMaxShare = 1024.0;
const float kMaxDifference = 16.0;  // in sigmas

ivec2 NumCells() {
  return ivec2(int(params.width_px), int(params.height_px)) * int(kIndexCellsPerPixel);
}

// Cells of the index map along each side of a tile.
const int kTileCells = 16;

// Around the cell of a surfel, on each side, where another is looked for.
const int kSearchCells = int(kIndexCellsPerPixel);

ivec2 NumTiles() { return (NumCells() + kTileCells - 1) / kTileCells; }

// In cells, of which whole numbers are the corners.
vec2 PlaceInCells(vec3 p_cam) { return (Project(p_cam) + 0.5) * float(kIndexCellsPerPixel); }

// Of an inverse depth; the weight is information on depth, 1/su^2.
float SurfelSigma(float inverse_depth, float weight) {
  return max(inverse_depth * inverse_depth / sqrt(weight), params.relative_sigma * inverse_depth);
}
