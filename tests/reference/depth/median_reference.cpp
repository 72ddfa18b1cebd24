// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reference/depth/median_reference.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace mono3d::reference {

FilteredDepth Median5x5(const std::vector<float>& inverse_depth,
                        const std::vector<float>& confidence, const MedianParams& params) {
  const int width = static_cast<int>(params.width_px);
  const int height = static_cast<int>(params.height_px);
  FilteredDepth result;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      std::vector<std::size_t> window;  // pixels with an estimate
      for (int dy = -2; dy <= 2; ++dy) {
        for (int dx = -2; dx <= 2; ++dx) {
          const int row = std::clamp(y + dy, 0, height - 1);
          const int column = std::clamp(x + dx, 0, width - 1);
          const auto pixel = static_cast<std::size_t>(row * width + column);
          if (inverse_depth[pixel] > 0) window.push_back(pixel);
        }
      }
      std::vector<float> values;
      for (const std::size_t pixel : window) values.push_back(inverse_depth[pixel]);
      std::sort(values.begin(), values.end());
      const float median = values.empty() ? 0.f : values[values.size() / 2];
      unsigned support = 0;
      float sum = 0;
      for (const std::size_t pixel : window) {
        if (std::abs(inverse_depth[pixel] - median) > params.tolerance) continue;
        ++support;
        sum += confidence[pixel];
      }
      const bool valid = support >= params.min_support;
      result.inverse_depth.push_back(valid ? median : 0.f);
      result.confidence.push_back(valid ? sum / 25 : 0.f);
    }
  }
  return result;
}

}  // namespace mono3d::reference
