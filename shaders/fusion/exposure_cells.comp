// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_ballot : require

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
  const uvec2 at = PixelOf(pixel);
  const uint cell = Divide(at.y, cell_px).x * kCellsPerRow + Divide(at.x, cell_px).x;
  const uint grey_seen = QuarterGrey(seen), grey_of_surfel = QuarterGrey(of_surfel);
  // Surfels of a block are neighbours, most of them in one cell: those of a subgroup that share one
  // are added up first. Whole numbers, so that the order does not matter.
  bool is_left = true;
  [[dont_unroll]] while (is_left) {
    if (cell != subgroupBroadcastFirst(cell)) continue;
    const uint count = subgroupBallotBitCount(subgroupBallot(true));
    const uint sum_seen = subgroupAdd(grey_seen);
    const uint sum_of_surfels = subgroupAdd(grey_of_surfel);
    if (subgroupElect()) {
      atomicAdd(cells[4u * cell], count);
      atomicAdd(cells[4u * cell + 1u], sum_seen);
      atomicAdd(cells[4u * cell + 2u], sum_of_surfels);
    }
    is_left = false;
  }
}
