// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <span>

#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

// What a list of errors amounts to, in the errors' unit. All 0 for an empty list.
struct ErrorStatistics {
  std::int64_t count = 0;
  double rmse = 0;    // root of the mean square
  double mean = 0;    // of the errors as they are; of distances this is the paper's MAE
  double median = 0;  // of an even number: the mean of the two in the middle
  double sigma = 0;   // standard deviation over all (divided by count), as evo has it
  double min = 0;
  double max = 0;
};

// Throws Error when an error is not finite.
ErrorStatistics ComputeStatistics(std::span<const double> errors);

}  // namespace mono3d
