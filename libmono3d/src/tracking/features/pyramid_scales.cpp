// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/features/pyramid_scales.h"

#include <cmath>

#include "core/clamped_int.h"

namespace mono3d::tracking {

PyramidScales::PyramidScales(const FeatureOptions& options) : factor_(options.scale_factor) {
  for (int level = 0; level < options.num_levels; ++level) {
    scales_.push_back(std::pow(factor_, level));
  }
}

int PyramidScales::Predict(double distance, double max_distance) const {
  const double level = std::log(max_distance / distance) / std::log(factor_);
  return ClampedInt(std::ceil(level), 0, num_levels() - 1);
}

int PyramidScales::Nearest(double distance, double max_distance) const {
  const double level = std::log(max_distance / distance) / std::log(factor_);
  return ClampedInt(std::round(level), 0, num_levels() - 1);
}

}  // namespace mono3d::tracking
