// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>

#include "mono3d/core/export.h"
#include "mono3d/products/map_axes.h"
#include "mono3d/products/raster_grid.h"

namespace MONO3D_EXPORT mono3d {

enum class RasterForm {
  kHeights,  // CV_32FC1, kNoHeight where there is none
  kPicture,  // CV_8UC4: red, green, blue, alpha
};

// A raster on its way to a Cloud Optimized GeoTIFF: written in any order to a file beside, and
// complete under its name by Finish. For one thread at a time. All functions throw Error (kIo) with
// GDAL's words.
class RasterFile {
 public:
  // Throws Error (kUnsupported) where mono3d was built without GDAL. `axes` must outlive it.
  RasterFile(std::filesystem::path path, const RasterGrid& grid, const MapAxes& axes,
             RasterForm form);
  // Removes what was written beside.
  ~RasterFile();
  RasterFile(const RasterFile&) = delete;
  RasterFile& operator=(const RasterFile&) = delete;

  static bool IsSupported();  // was mono3d built with GDAL?

  const RasterGrid& grid() const { return grid_; }

  // `place` lies within the raster.
  void Write(const cv::Rect& place, const cv::Mat& cells);
  cv::Mat Read(const cv::Rect& place) const;

  // Heights where there are none, by those around that are at most so many cells away, the nearer
  // the more (inverse distance).
  void Fill(double max_distance_cells);

  // As Cloud Optimized GeoTIFF with overviews, without loss.
  void Finish();
  // Lines of equal height, each a whole number of `interval` in units of the heights, as a layer
  // "contours" with a field "height" of a GeoPackage. Of heights alone.
  void WriteContours(const std::filesystem::path& path, double interval) const;

 private:
  struct Dataset;

  std::filesystem::path path_;
  RasterGrid grid_;
  RasterForm form_;
  std::unique_ptr<Dataset> dataset_;
};

}  // namespace mono3d
