// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors
#version 450
#extension GL_GOOGLE_include_directive : require

// What the image and the model say of the brightness of the same places: per cell of the image the
// sums over the surfels that its pixels confirm. Means over a cell do not depend on how sharp the
// image or the surfels' colours are, and hardly on noise. Clipped values say nothing and stay out.
#include "fusion/surfel.glsl"
#include "fusion/view.glsl"

layout(binding = 0, r32ui) uniform readonly uimageBuffer association;  // per surfel
layout(binding = 1, r32ui) uniform readonly uimageBuffer colour;       // per pixel, 0xBBGGRR
layout(binding = 2, rgba32ui) uniform readonly uimageBuffer history;   // per surfel
layout(binding = 3, r32ui) uniform readonly uimageBuffer blocks;       // to work on
// Per cell, row by row: number of surfels, sum of the image's grey, of the surfels', in 1/4 grey
// values; 0. All 0 before.
layout(binding = 4, std430) buffer Cells { uint cells[]; };

// Cells of a row of the image, at most; kExposureCellsPerRow and kMinExposureCell_px of exposure.h.
const uint kCellsPerRow = 24u;
const uint kMinCellPx = 16u;

uint QuarterGrey(uvec3 rgb10) {
  return (77u * rgb10.x + 150u * rgb10.y + 29u * rgb10.z + 128u) >> 8;
}

// Channels of 10 bits, of which images fill 8.
bool IsClipped(uvec3 rgb10) {
  return any(greaterThanEqual(rgb10, uvec3(1020u))) || any(lessThan(rgb10, uvec3(4u)));
}

void main() {
  const uint i = SurfelOfBlock(imageLoad(blocks, int(WorkGroupIndex())).x);
  if (i >= params.num_surfels) return;
  const uint pixel = imageLoad(association, int(i)).x;
  if (!IsPixel(pixel)) return;
  const uvec3 seen = uvec3(UnpackColour(Colour10From8(imageLoad(colour, int(pixel)).x)));
  const uvec3 of_surfel = uvec3(UnpackColour(imageLoad(history, int(i)).x));
  if (IsClipped(seen) || IsClipped(of_surfel)) return;
  const uint cell_px = max((params.width_px + kCellsPerRow - 1u) / kCellsPerRow, kMinCellPx);
  const uint x = pixel % params.width_px, y = pixel / params.width_px;
  const uint first = 4u * ((y / cell_px) * kCellsPerRow + x / cell_px);
  atomicAdd(cells[first], 1u);
  atomicAdd(cells[first + 1u], QuarterGrey(seen));
  atomicAdd(cells[first + 2u], QuarterGrey(of_surfel));
}
