// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reference/depth/fine_sweep_reference.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <opencv2/core/types.hpp>

#include "reference/depth/plane_sweep_reference.h"

namespace mono3d::reference {
namespace {

// Four times the mean over the sources `first` to `last` - 1 that see the block of `pixel`.
int SideCost(const FineCensus& census, const SourceProjections& projections, std::size_t first,
             std::size_t last, std::size_t pixel, double w, const FineSweepParams& params) {
  const int width = static_cast<int>(params.width_px);
  const int height = static_cast<int>(params.height_px);
  const int x = static_cast<int>(pixel) % width;
  const int y = static_cast<int>(pixel) / width;
  const Eigen::Vector3d middle(x / 2 * 2 + 0.5, y / 2 * 2 + 0.5, 1);
  int sum = 0, num_visible = 0;
  for (std::size_t s = first; s < last; ++s) {
    const Eigen::Vector3d at = projections[s].A * middle + w * projections[s].b;
    const int column = static_cast<int>(std::floor(at.x() / at.z()));
    const int row = static_cast<int>(std::floor(at.y() / at.z()));
    if (at.z() <= 0 || column < 0 || row < 0 || column > width - 2 || row > height - 2) continue;
    const PixelBounds& bounds = projections[s].bounds;
    if (!bounds.Contain({column, row}) || !bounds.Contain({column + 1, row + 1})) continue;
    if (!projections[s].reference.Contain({x / 2 * 2, y / 2 * 2})) continue;
    // From the middle of the block, in halves of a pixel; in a picture that is turned clockwise.
    cv::Point from_middle(x % 2 * 2 - 1, y % 2 * 2 - 1);
    for (unsigned i = 0; i < projections[s].quarter_turns; ++i) {
      from_middle = {-from_middle.y, from_middle.x};
    }
    const auto place = static_cast<std::size_t>((row + (from_middle.y + 1) / 2) * width + column +
                                                (from_middle.x + 1) / 2);
    sum += std::popcount(census[1 + s][place] ^ census[0][pixel]);
    ++num_visible;
  }
  return num_visible > 0 ? static_cast<int>(std::floor(4.0 * sum / num_visible + 0.5)) : 255;
}

}  // namespace

FineVolume FineSweep(const FineCensus& census, const SourceProjections& projections,
                     const std::vector<FineRange>& ranges, const FineSweepParams& params,
                     int side_tolerance) {
  const std::size_t num_sources = projections.size();
  FineVolume costs(ranges.size());
  for (std::size_t pixel = 0; pixel < ranges.size(); ++pixel) {
    const std::size_t x = pixel % params.width_px;
    const std::size_t y = pixel / params.width_px;
    const FineRange& range = ranges[y / 2 * 2 * params.width_px + x / 2 * 2];
    for (std::size_t d = 0; d < costs[pixel].size(); ++d) {
      const double w = params.inverse_depth +
                       (range.first_plane + double(d)) * double(params.inverse_depth_step);
      const int before = SideCost(census, projections, 0, num_sources / 2, pixel, w, params);
      const int after =
          SideCost(census, projections, num_sources / 2, num_sources, pixel, w, params);
      const bool matched = !range.narrow || (d >= 4 && d < 12);
      costs[pixel][d] =
          static_cast<std::uint8_t>(matched ? BothSides(before, after, side_tolerance) : 255);
    }
  }
  return costs;
}

}  // namespace mono3d::reference
