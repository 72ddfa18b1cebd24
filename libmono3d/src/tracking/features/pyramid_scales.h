// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <vector>

#include "mono3d/tracking/tracker.h"

namespace mono3d::tracking {

// The scales of the pyramid's levels and what follows from them.
class PyramidScales {
 public:
  explicit PyramidScales(const FeatureOptions& options);

  int num_levels() const { return static_cast<int>(scales_.size()); }
  double factor() const { return factor_; }
  double Scale(int level) const { return scales_[static_cast<std::size_t>(level)]; }
  // Variance of a key point's position, in px^2 of the full image: one px of its level.
  double Variance(int level) const { return Scale(level) * Scale(level); }
  // The level on which a patch of level 0 seen from `max_distance` shows from `distance`, to the
  // nearest.
  int Nearest(double distance, double max_distance) const;
  // The level at which something shows that shows at level 0 at `max_distance`, seen from
  // `distance`.
  int Predict(double distance, double max_distance) const;

 private:
  double factor_;
  std::vector<double> scales_;
};

}  // namespace mono3d::tracking
