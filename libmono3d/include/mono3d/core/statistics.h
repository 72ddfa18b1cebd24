// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

// The value at place floor(share * (n - 1)) of the n sorted values, for a share of 0 to 1. There
// must be one value at least. Takes O(n).
template <typename T>
T Quantile(std::vector<T> values, double share) {
  const auto place = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + place, values.end());
  return values[static_cast<std::size_t>(place)];
}

// The value in the middle of the sorted ones, of two the upper: always one of the values. There
// must be one value at least. Takes O(n).
template <typename T>
T UpperMedian(std::vector<T> values) {
  const auto upper = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), upper, values.end());
  return *upper;
}

// The same; 0 when there are no values.
template <typename T>
T UpperMedianOrZero(std::vector<T> values) {
  return values.empty() ? T{0} : UpperMedian(std::move(values));
}

// Of an even number of values the mean of the two in the middle. There must be one value at least.
// Takes O(n).
template <typename T>
T Median(std::vector<T> values) {
  const auto upper = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), upper, values.end());
  if (values.size() % 2 == 1) return *upper;
  return (*std::max_element(values.begin(), upper) + *upper) / 2;
}

}  // namespace mono3d
