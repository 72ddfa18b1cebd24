// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <functional>
#include <opencv2/core/mat.hpp>

#include "mono3d/core/export.h"
#include "mono3d/products/map_surfels.h"
#include "mono3d/products/raster_grid.h"

namespace MONO3D_EXPORT mono3d {

// The height of a cell that nothing is known of.
constexpr float kNoHeight = -9999;

// A part of a raster: `place` in cells of the whole.
using RasterSink = std::function<void(const cv::Rect& place, const cv::Mat& cells)>;

// The digital surface model: the height of the highest surface in each cell, kNoHeight where there
// is none, as CV_32FC1 of whole rows from the north; each row once. Surfels are discs: a cell's
// height is the mean of the discs over its centre, weighted by confidence, nearness and by how much
// of a disc is seen from above. Of surfaces one above the other, the highest one that enough speaks
// for; what floats alone is left out. Gaps of a cell or two between discs are closed.
// Memory: a part of the rows at a time, 100 MB. Throws what the sink and reading throw.
void MakeSurfaceModel(MapSurfels& surfels, const MapAxes& axes, const RasterGrid& grid,
                      const RasterSink& sink);

}  // namespace mono3d
