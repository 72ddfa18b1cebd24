// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Cells of the map of the nearest surfels. After view.glsl. Surfels lie a pixel apart as seen from
// where they were made: from four times nearer there still is one in each cell of a surface.
const float kNearestCell_px = 4.0;

// Of a pixel within the image.
uint NearestCellOf(vec2 pixel) {
  const uint columns = (params.width_px + 3u) / 4u;
  return (uint(pixel.y) / 4u) * columns + uint(pixel.x) / 4u;
}
