// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Cells of the map of the nearest surfels. After view.glsl. Surfels lie a pixel apart as seen from
// where they were made: from four times nearer there still is one in each cell of a surface.
const uint kNearestCell_px = 4u;

// Of a pixel within the image.
uint NearestCellOf(vec2 pixel) {
  const uint columns = (params.width_px + kNearestCell_px - 1u) / kNearestCell_px;
  const uvec2 cell = uvec2(pixel) / kNearestCell_px;
  return cell.y * columns + cell.x;
}
