// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cmath>
#include <cstddef>
#include <numeric>
#include <vector>

namespace mono3d::tracking {

inline double Sum(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

// Is one model better than another beyond chance? The difference of their errors is a sum over
// independent points, so its standard deviation is known from their scatter (Vuong 1989).
inline bool IsClearlyBetter(const std::vector<double>& better, const std::vector<double>& worse) {
  constexpr double kMinSigmas = 3.5;  // by chance one time in 4000
  // Errors that are no noise, as of the calibration, may favour a wrong motion by a little.
  constexpr double kMaxCostShare = 0.9;
  if (!(Sum(better) < kMaxCostShare * Sum(worse))) return false;
  const auto count = static_cast<double>(better.size());
  const double mean = (Sum(worse) - Sum(better)) / count;
  double variance = 0;
  for (std::size_t i = 0; i < better.size(); ++i) {
    variance += std::pow(worse[i] - better[i] - mean, 2) / count;
  }
  return mean * std::sqrt(count) > kMinSigmas * std::sqrt(variance);
}

// The same of errors that are at most `most`, as those of outliers are. What is an outlier of both
// tells nothing of either.
inline bool IsClearlyBetterOfInliers(const std::vector<double>& better,
                                     const std::vector<double>& worse, double most) {
  std::vector<double> of_better;
  std::vector<double> of_worse;
  for (std::size_t i = 0; i < better.size(); ++i) {
    if (better[i] >= most && worse[i] >= most) continue;
    of_better.push_back(better[i]);
    of_worse.push_back(worse[i]);
  }
  return IsClearlyBetter(of_better, of_worse);
}

}  // namespace mono3d::tracking
