// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "evaluation/median.h"

#include <algorithm>
#include <cstddef>

namespace mono3d {

double Median(std::vector<double> values) {
  const auto upper = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), upper, values.end());
  if (values.size() % 2 == 1) return *upper;
  return (*std::max_element(values.begin(), upper) + *upper) / 2;
}

}  // namespace mono3d
