// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <algorithm>

namespace mono3d {

// The integer part of `value` within [min, max], which is `min` where `value` is not a number. A
// value that an int does not hold must not be converted before it is clamped: that is undefined.
inline int ClampedInt(double value, int min, int max) {
  if (!(value > min)) return min;
  return static_cast<int>(std::min(value, static_cast<double>(max)));
}

}  // namespace mono3d
