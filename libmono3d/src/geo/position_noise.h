// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "mono3d/geo/georeference.h"

namespace mono3d {

// Rows of one axis, whitened: innovations over their standard deviations, in the order of time.
struct WhitenedRows {
  Eigen::MatrixXd rows;      // one for each that is used; the columns as given
  double sum_log_sigma = 0;  // of the innovations: what the likelihood needs beside the rows
};

// Takes the correlation out of rows whose errors are `noise`, by a Kalman filter of the wandering
// error, which costs O(rows) (Harvey 1989). `times_s` ascend; rows that are not used count as
// missing.
WhitenedRows Whiten(const Eigen::MatrixXd& rows, std::span<const double> times_s,
                    const std::vector<bool>& is_used, const PositionNoise& noise);

// One noise that is looked at, of unit total variance, and how likely it is beforehand.
struct NoiseShape {
  PositionNoise unit;
  double log_prior = 0;
};

// A grid over the share of the wandering part and its time.
std::vector<NoiseShape> NoiseShapes();

}  // namespace mono3d
