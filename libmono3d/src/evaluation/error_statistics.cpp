// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/evaluation/error_statistics.h"

#include <algorithm>
#include <cmath>

#include "mono3d/core/error.h"
#include "mono3d/core/statistics.h"

namespace mono3d {
ErrorStatistics ComputeStatistics(std::span<const double> errors) {
  ErrorStatistics statistics;
  if (errors.empty()) return statistics;
  double sum = 0;
  double sum_of_squares = 0;
  for (const double error : errors) {
    if (!std::isfinite(error)) throw Error("an error to take statistics of is not finite");
    sum += error;
    sum_of_squares += error * error;
  }
  const auto count = static_cast<double>(errors.size());
  statistics.count = static_cast<std::int64_t>(errors.size());
  statistics.mean = sum / count;
  statistics.rmse = std::sqrt(sum_of_squares / count);
  double sum_of_square_deviations = 0;
  for (const double error : errors) {
    sum_of_square_deviations += (error - statistics.mean) * (error - statistics.mean);
  }
  statistics.sigma = std::sqrt(sum_of_square_deviations / count);
  statistics.median = Median(std::vector<double>(errors.begin(), errors.end()));
  const auto [min, max] = std::minmax_element(errors.begin(), errors.end());
  statistics.min = *min;
  statistics.max = *max;
  return statistics;
}

}  // namespace mono3d
