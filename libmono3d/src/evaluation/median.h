// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

namespace mono3d {

// Of an even number of values: the mean of the two in the middle. There must be one at least.
double Median(std::vector<double> values);

}  // namespace mono3d
