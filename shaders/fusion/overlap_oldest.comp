// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors
#version 450
#extension GL_GOOGLE_include_directive : require

// The oldest surfel in each tile of the index map, which has the smallest number: where it is not
// older than a surfel, none of the tile is.
#include "fusion/overlap.glsl"

layout(binding = 0, r32ui) uniform readonly uimageBuffer index_map;  // per cell: number, depth
layout(binding = 1, std430) writeonly buffer Oldest { uint oldest[]; };  // per tile; kNoSurfel: none

void main() {
  const uint tile = ItemIndex();
  const ivec2 tiles = NumTiles();
  if (tile >= uint(tiles.x * tiles.y)) return;
  const ivec2 first = ivec2(int(tile) % tiles.x, int(tile) / tiles.x) * kTileCells;
  const ivec2 size = NumCells();
  uint smallest = kNoSurfel;
  for (int y = first.y; y < min(first.y + kTileCells, size.y); ++y) {
    for (int x = first.x; x < first.x + kTileCells; ++x) {
      // The last cell of the row again where the tile leaves the image.
      const int cell = y * size.x + min(x, size.x - 1);
      smallest = min(smallest, imageLoad(index_map, 2 * cell).x);
    }
  }
  oldest[tile] = smallest;
}
