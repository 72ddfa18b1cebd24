// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reference/depth/upsample_reference.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace mono3d::reference {

FilteredDepth Upsample(const FilteredDepth& coarse, const UpsampleParams& params) {
  const int width = static_cast<int>(params.coarse_width_px);
  const int height = static_cast<int>(params.coarse_height_px);
  const int factor = static_cast<int>(params.factor);
  FilteredDepth result;
  for (int y = 0; y < static_cast<int>(params.height_px); ++y) {
    for (int x = 0; x < static_cast<int>(params.width_px); ++x) {
      const double at_x = (x + 0.5) / factor - 0.5;
      const double at_y = (y + 0.5) / factor - 0.5;
      const int nearest_x = std::min(x / factor, width - 1);
      const int nearest_y = std::min(y / factor, height - 1);
      const float nearest =
          coarse.inverse_depth[static_cast<std::size_t>(nearest_y * width + nearest_x)];
      double depth = 0;
      double confidence = 0;
      double weights = 0;
      for (const int row : {int(std::floor(at_y)), int(std::floor(at_y)) + 1}) {
        for (const int column : {int(std::floor(at_x)), int(std::floor(at_x)) + 1}) {
          const auto pixel = static_cast<std::size_t>(std::clamp(row, 0, height - 1) * width +
                                                      std::clamp(column, 0, width - 1));
          const float w = coarse.inverse_depth[pixel];
          if (w <= 0 || std::abs(w - nearest) > params.tolerance) continue;
          const double weight = (1 - std::abs(at_x - column)) * (1 - std::abs(at_y - row));
          depth += weight * double(w);
          confidence += weight * double(coarse.confidence[pixel]);
          weights += weight;
        }
      }
      const bool valid = nearest > 0 && weights > 0;
      result.inverse_depth.push_back(valid ? static_cast<float>(depth / weights) : 0.f);
      result.confidence.push_back(valid ? static_cast<float>(confidence / weights) : 0.f);
    }
  }
  return result;
}

}  // namespace mono3d::reference
