// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "synthetic/flight_statistics.h"
#include "synthetic/noise.h"

namespace mono3d::synthetic {

// `count` values between spread.min and spread.max with its mean and standard deviation, of a beta
// distribution: the middles of `count` slices of equal probability, shuffled. So even a few values
// have the statistics asked for, whatever the seed. Throws Error when no beta distribution has
// them.
std::vector<double> DrawSpread(int count, const Spread& spread, RandomNumbers& random);

// The values in an order of chance.
template <typename T>
void Shuffle(std::vector<T>& values, RandomNumbers& random) {
  for (std::size_t i = values.size(); i > 1; --i) {
    const auto j = static_cast<std::size_t>(random.Uniform(0, static_cast<double>(i)));
    std::swap(values[i - 1], values[j]);
  }
}

}  // namespace mono3d::synthetic
