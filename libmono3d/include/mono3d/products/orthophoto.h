// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/products/finished_run.h"
#include "mono3d/products/map_axes.h"
#include "mono3d/products/raster_grid.h"
#include "mono3d/products/surface_model.h"

namespace MONO3D_EXPORT mono3d {

// Heights of a surface model, read as they are needed.
struct HeightSource {
  RasterGrid grid;
  std::function<cv::Mat(const cv::Rect& place)> read;  // CV_32FC1, kNoHeight where there is none
};

struct OrthophotoReport {
  std::size_t num_views = 0;                // images that were used
  std::vector<std::string> missing_images;  // that are not there, or not of the camera's size
};

// The orthophoto: what the images show of each cell of `grid`, CV_8UC4 (red, green, blue, alpha; 0
// where the surface has no height or no image sees it), window by window; each cell once.
// A cell takes the image that sees it best: near, from straight above, near the middle of the
// image, and not hidden by the surface model. Near the border between two views both are mixed. The
// views are balanced by a gain for each of the colours, by what two and more of them see. The poses
// are those of the middle line: a rolling shutter is not modelled. Memory: images are kept up to 1
// GB. Throws Error where the run has no images, and what `heights` and `sink` throw.
OrthophotoReport MakeOrthophoto(const FinishedRun& run, const MapAxes& axes,
                                const HeightSource& heights, const RasterGrid& grid,
                                const RasterSink& sink);

}  // namespace mono3d
