// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "mono3d/core/export.h"
#include "mono3d/products/finished_run.h"

namespace MONO3D_EXPORT mono3d {

// Square cells of a map, row by row from the north.
struct RasterGrid {
  double west = 0;   // of the outer corner of the first cell
  double north = 0;  // of it
  double cell = 1;   // edge, units of the map
  int width = 0;     // cells
  int height = 0;

  // On the map, of cell coordinates whose whole numbers are centres of cells, and back.
  Eigen::Vector2d ToMap(double column, double row) const {
    return {west + (column + 0.5) * cell, north - (row + 0.5) * cell};
  }
  Eigen::Vector2d ToCell(const Eigen::Vector2d& place) const {
    return {(place.x() - west) / cell - 0.5, (north - place.y()) / cell - 0.5};
  }
};

// The cells, at whole multiples of their edge, that cover a part of the map. Throws Error where
// they would be more than two thousand million.
RasterGrid GridOver(const Eigen::AlignedBox2d& part, double cell);

// What a pixel of the images shows of the ground, in units of the model: the median over the images
// of the median depth of what they see over the focal length; 0 where the run has no images. Of
// images of the size of the depth maps where `of_depth_maps`.
double GroundSampleDistance(const FinishedRun& run, bool of_depth_maps);

// Two digits, the next one above: 0.0437 becomes 0.044.
double RoundedCell(double size);

}  // namespace mono3d
