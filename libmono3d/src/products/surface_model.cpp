// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/products/surface_model.h"

#include <algorithm>
#include <cmath>

#include "products/surface_layers.h"

namespace mono3d {
namespace {

// Of the layers, in memory.
constexpr std::size_t kLayerBytes = std::size_t{100} << 20;
// Rows above and below that neighbourhoods and patches reach into.
constexpr int kHaloRows = 16;

}  // namespace

void MakeSurfaceModel(MapSurfels& surfels, const MapAxes& axes, const RasterGrid& grid,
                      const RasterSink& sink) {
  const double height_units = grid.cell * axes.ModelUnitsPerUnit();
  const double radius_scale = 1 / axes.ModelUnitsPerUnit();
  const std::size_t row_bytes = static_cast<std::size_t>(grid.width) * SurfaceLayers::kBytesPerCell;
  const int rows_at_once = std::max(
      4 * kHaloRows, static_cast<int>(std::min<std::size_t>(kLayerBytes / row_bytes, 1 << 20)));
  MapSurfelBlock block;
  for (int row = 0; row < grid.height; row += rows_at_once) {
    const int num_rows = std::min(rows_at_once, grid.height - row);
    const int first = std::max(0, row - kHaloRows);
    const int last = std::min(grid.height, row + num_rows + kHaloRows);
    SurfaceLayers layers(grid, first, last - first, height_units);
    for (std::size_t index = 0; index < surfels.num_blocks(); ++index) {
      const double reach = surfels.max_radius(index) * radius_scale + grid.cell;
      const Eigen::AlignedBox3d& bounds = surfels.bounds(index);
      if (bounds.min().y() - reach > grid.ToMap(0, first - 1).y()) continue;
      if (bounds.max().y() + reach < grid.ToMap(0, last).y()) continue;
      surfels.Read(index, block);
      layers.Draw(block, radius_scale);
    }
    cv::Mat heights = layers.Heights();
    const auto gap = static_cast<float>(kSurfaceGap_cells * height_units);
    ClosePinholes(heights);
    RemoveFloatingPatches(heights, gap);
    ClosePinholes(heights);
    sink({0, row, grid.width, num_rows}, heights.rowRange(row - first, row - first + num_rows));
  }
}

}  // namespace mono3d
