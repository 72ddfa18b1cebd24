// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Tiles of 32x8 pixels in which something was not matched; only these are worked on at full
// resolution. The workgroups of a dispatch, in rows along x and y, have the tiles of a list one
// after the other. The including shader declares the binding `tiles`: their numbers in rows from
// the top; after the last one kNoTile, far below any map. Host side: depth/inference_tiles.h.
const int kTileWidth = 32;
const int kTileHeight = 8;

// Of the first pixel; outside the map at the end of the list.
ivec2 TileCorner(uint width_px) {
  const int tiles_per_row = (int(width_px) + kTileWidth - 1) / kTileWidth;
  const int index = int(gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x);
  const int tile = int(imageLoad(tiles, index).x);
  return ivec2(kTileWidth * (tile % tiles_per_row), kTileHeight * (tile / tiles_per_row));
}
