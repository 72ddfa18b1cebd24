// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cmath>
#include <string>

namespace mono3d::tracking {

// Relative standard deviation of the scale of one part of a map against another's up to which they
// are one map. With more, what both see lies apart by more than the model's registration bridges.
inline constexpr double kMaxScaleSigma = 0.05;

// "1.3 %".
inline std::string PercentText(double share) {
  constexpr double kKnown = 1000;  // beyond, nothing is
  if (!(share < kKnown)) return "unknown";
  return std::to_string(std::lround(1000 * share) / 10) + "." +
         std::to_string(std::lround(1000 * share) % 10) + " %";
}

}  // namespace mono3d::tracking
