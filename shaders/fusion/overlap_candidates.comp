// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors
#version 450
#extension GL_GOOGLE_include_directive : require

// Lists the surfels that may have an older one of another part in their place: those around which,
// in the image, there is one at all. In any order.
#include "fusion/overlap.glsl"

layout(binding = 0, rgba32f) uniform readonly imageBuffer position_radius;  // per surfel
layout(binding = 1, rgba32f) uniform readonly imageBuffer normal_weight;    // per surfel
layout(binding = 2, rgba32ui) uniform readonly uimageBuffer history;        // per surfel
layout(binding = 3, r32ui) uniform readonly uimageBuffer blocks;    // to work on
// Per anchor the end of the surfels of other parts that are older.
layout(binding = 4, r32ui) uniform readonly uimageBuffer end_of_older;
layout(binding = 5, r32ui) uniform readonly uimageBuffer oldest;  // surfel per tile
layout(binding = 6, rgba32f) uniform readonly imageBuffer anchors;  // two per anchor, see UseAnchor
layout(binding = 7, std430) writeonly buffer Candidates { uint candidates[]; };
layout(binding = 8, std430) buffer Count { uint num_candidates; };  // 0 before

uint OldestOfTile(ivec2 cell) {
  const ivec2 tile = clamp(cell, ivec2(0), NumCells() - 1) / kTileCells;
  return imageLoad(oldest, tile.y * NumTiles().x + tile.x).x;
}

// Of the cells that are searched, which lie in four tiles at most.
uint OldestAround(ivec2 own) {
  const ivec2 first = own - kSearchCells, last = own + kSearchCells;
  return min(min(OldestOfTile(first), OldestOfTile(ivec2(last.x, first.y))),
             min(OldestOfTile(ivec2(first.x, last.y)), OldestOfTile(last)));
}

void main() {
  const uint i = SurfelOfBlock(imageLoad(blocks, int(WorkGroupIndex())).x);
  if (i >= params.num_surfels) return;
  const int anchor = int(Low16(imageLoad(history, int(i)).w));
  UseAnchor(imageLoad(anchors, 2 * anchor), imageLoad(anchors, 2 * anchor + 1));
  const vec3 p_cam = PointToCamera(imageLoad(position_radius, int(i)).xyz);
  if (p_cam.z <= 0.0 || imageLoad(normal_weight, int(i)).w <= 0.0) return;
  const ivec2 own = ivec2(floor(PlaceInCells(p_cam)));
  if (OldestAround(own) >= imageLoad(end_of_older, anchor).x) return;
  candidates[atomicAdd(num_candidates, 1u)] = i;
}
