// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/draws.h"

#include <algorithm>
#include <cmath>

#include "mono3d/core/error.h"

namespace mono3d::synthetic {
namespace {

// Cumulative probabilities of a beta distribution on a fine lattice of [0, 1], by the midpoint
// rule.
std::vector<double> CumulativeBeta(double a, double b) {
  constexpr int kSteps = 20'000;
  std::vector<double> sums(kSteps + 1, 0);
  for (int i = 0; i < kSteps; ++i) {
    const double x = (i + 0.5) / kSteps;
    const double density = std::exp((a - 1) * std::log(x) + (b - 1) * std::log1p(-x));
    sums[static_cast<std::size_t>(i) + 1] = sums[static_cast<std::size_t>(i)] + density;
  }
  for (double& sum : sums) sum /= sums.back();
  return sums;
}

}  // namespace

std::vector<double> DrawSpread(int count, const Spread& spread, RandomNumbers& random) {
  const double range = spread.max - spread.min;
  const double mean = (spread.mean - spread.min) / range;
  const double variance = spread.sigma * spread.sigma / (range * range);
  const double sum_ab = mean * (1 - mean) / variance - 1;
  if (!(mean > 0 && mean < 1 && variance > 0 && sum_ab > 0)) {
    throw Error("no beta distribution has this mean and standard deviation");
  }
  const std::vector<double> cumulative = CumulativeBeta(mean * sum_ab, (1 - mean) * sum_ab);
  std::vector<double> values;
  for (int i = 0; i < count; ++i) {
    const double probability = (i + 0.5) / count;
    const auto above = std::lower_bound(cumulative.begin(), cumulative.end(), probability);
    const double x = (static_cast<double>(above - cumulative.begin()) - 0.5) /
                     static_cast<double>(cumulative.size() - 1);
    values.push_back(spread.min + range * x);
  }
  Shuffle(values, random);
  return values;
}

}  // namespace mono3d::synthetic
