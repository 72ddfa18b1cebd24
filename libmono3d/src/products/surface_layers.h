// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstddef>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "mono3d/products/map_surfels.h"
#include "mono3d/products/raster_grid.h"

namespace mono3d {

// Some rows of a surface model while surfels are drawn into them: each cell has up to three
// surfaces one above the other.
class SurfaceLayers {
 public:
  // `height_units` is the edge of a cell in units of the heights.
  SurfaceLayers(const RasterGrid& grid, int first_row, int num_rows, double height_units);

  // The part of the block that lies over these rows.
  void Draw(const MapSurfelBlock& surfels, double radius_scale);

  // The highest surface of each cell that enough speaks for, kNoHeight where there is none;
  // CV_32FC1.
  cv::Mat Heights() const;

  static constexpr std::size_t kBytesPerCell = 3 * 2 * sizeof(float);

 private:
  struct Layer {
    float height = 0;
    float weight = 0;  // 0: none
  };
  using Cell = std::array<Layer, 3>;

  void Add(Cell& cell, float height, float weight) const;
  float SupportOf(int row, int column, float height) const;

  RasterGrid grid_;
  int first_row_;
  int num_rows_;
  double height_units_;
  float gap_;  // surfaces that lie closer are one
  std::vector<Cell> cells_;
};

// Takes out patches of a few cells that stand off from all around them, and closes gaps of a cell
// or two; CV_32FC1 in place. `gap` as of the layers.
void RemoveFloatingPatches(cv::Mat& heights, float gap);
void ClosePinholes(cv::Mat& heights);

// How far surfaces must be apart to be two, in cells. A height errs by about one: a third of a
// pixel where the images are a third of the height apart. Three standard deviations.
constexpr double kSurfaceGap_cells = 3;

}  // namespace mono3d
