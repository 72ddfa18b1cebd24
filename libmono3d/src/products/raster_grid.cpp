// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/products/raster_grid.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

double MedianNumber(std::vector<double>& values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

RasterGrid GridOver(const Eigen::AlignedBox2d& part, double cell) {
  constexpr double kMaxCells = 2e9;  // GDAL counts pixels of a row and rows in 32 bits
  const double left = std::floor(part.min().x() / cell), right = std::ceil(part.max().x() / cell);
  const double bottom = std::floor(part.min().y() / cell), top = std::ceil(part.max().y() / cell);
  const double width = std::max(1.0, right - left), height = std::max(1.0, top - bottom);
  if (!(cell > 0) || !(width * height <= kMaxCells)) {
    throw Error(ErrorParts{.what = "the raster would be too large",
                           .where = "--gsd " + std::to_string(cell),
                           .expected = "at most 2000 million cells",
                           .found = std::to_string(width) + " x " + std::to_string(height),
                           .code = ErrorCode::kInvalidArgument});
  }
  return {.west = left * cell,
          .north = top * cell,
          .cell = cell,
          .width = static_cast<int>(width),
          .height = static_cast<int>(height)};
}

double GroundSampleDistance(const FinishedRun& run, bool of_depth_maps) {
  std::vector<double> of_images;
  for (std::size_t i = 0; i < run.images.size() && i < run.sparse.images.size(); ++i) {
    const CameraModel& camera = run.images[i].camera;
    const Pose T_cam_world = run.images[i].T_world_cam.Inverse();
    std::vector<double> depths;
    for (const SparseObservation& observation : run.sparse.images[i].observations) {
      if (!observation.point) continue;
      const double depth = (T_cam_world * run.sparse.points[*observation.point].p_world).z();
      if (depth > 0) depths.push_back(depth);
    }
    if (depths.empty()) continue;
    double focal_px = std::sqrt(camera.fx * camera.fy);
    // Depth maps are of images that --resize made smaller.
    if (of_depth_maps && run.depth_camera.width > 0) {
      focal_px = std::min(focal_px, std::sqrt(run.depth_camera.fx * run.depth_camera.fy));
    }
    of_images.push_back(MedianNumber(depths) / focal_px);
  }
  return MedianNumber(of_images);
}

double RoundedCell(double size) {
  const double step = std::pow(10, std::floor(std::log10(size)) - 1);
  // What is a whole number of steps but for rounding stays as it is.
  return std::ceil(size / step - 1e-9) * step;
}

}  // namespace mono3d
